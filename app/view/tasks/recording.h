// A turn of the clip that the viewer writes as images and as a film.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/base/output_folder.h"
#include "app/view/view_state.h"

namespace mray::app {

/// The images of a recording: all whole frames of the clip, or one orbit of the camera around its
/// target where the clip has a single one. The first backend's, with as many samples as `samples`
/// and the state allow. Throws Error(kBadArgument) for a clip of more than a million frames.
std::vector<ImageRequest> turn_of(const ViewState& state, const Clip& clip, std::uint32_t samples);

/// Asks for one image after the other, writes each as a PNG file, and then a film of all of them,
/// where ffmpeg is installed. Members are called by one thread, and do not wait for the film.
class Recording {
public:
    /// Makes the folder, the first of morphray_turn_0001, ... that is free in the current one, with
    /// frame_0000.png and so on for files; the film is FOLDER.mp4. The options are those of the
    /// scene. Throws Error.
    Recording(const ViewState& state, const Clip& clip, const Options& options,
              std::uint32_t samples);
    /// Ends a film that is being written, which leaves none. What is written stays. After a signal
    /// the process may end before that.
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    /// The image that is wanted; null when all are written.
    const ImageRequest* wanted() const;
    /// Writes the image that is wanted. Throws Error if it cannot be written, or has failed.
    void add(const TracedImage& image);
    /// Whether images and film are written. Throws Error if the film could not be.
    bool is_done();

    /// "recording 12 of 97", or "writing morphray_turn_0001.mp4".
    std::string activity() const;
    /// "12 images in morphray_turn_0001", with the film, or why there is none; "no image is
    /// written".
    std::string summary() const;

private:
    std::filesystem::path file_of(std::size_t image) const;

    Options options_;
    std::vector<ImageRequest> requests_;
    std::vector<std::string> labels_;
    std::uint32_t rate_;
    std::size_t written_ = 0;
    std::filesystem::path film_file_;
    OutputFolder folder_;
    std::atomic<bool> cancel_ = false;
    bool has_film_ = false;
    std::future<void> film_;
};

}  // namespace mray::app
