#include "app/view/tasks/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "app/clip/frames.h"
#include "app/clip/render_command.h"
#include "app/files/video/video.h"
#include "app/terminal/interrupt.h"
#include "app/view/copy_command.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/image/png.h"

namespace mray::app {
namespace {

namespace fs = std::filesystem;

/// The images of an orbit: five seconds at the viewer's usual speed.
constexpr int kOrbitImages = 120;

std::vector<double> recorded_frames(const Clip& clip) {
    Options all;
    all.frames = "all";
    return select_frames(all, clip, DefaultFrames::kAll);
}

fs::path film_of(const fs::path& folder) { return folder.native() + ".mp4"; }

/// The first name in the current folder of which there is neither folder nor film.
fs::path free_folder() {
    for (int i = 1;; ++i) {
        fs::path folder = fmt::format("morphray_turn_{:04}", i);
        if (!fs::exists(folder) && !fs::exists(film_of(folder))) return folder;
    }
}

/// The names of images: their frames, or their places in an orbit.
std::vector<std::string> labels_of(const Clip& clip, std::size_t images) {
    std::vector<double> frames = recorded_frames(clip);
    if (frames.size() == 1) {
        frames.clear();
        for (std::size_t i = 0; i < images; ++i) frames.push_back(static_cast<double>(i));
    }
    const FrameDigits digits = digits_of(frames, clip);
    std::vector<std::string> labels;
    for (const double frame : frames) labels.push_back(frame_label(frame, digits));
    return labels;
}

}  // namespace

std::vector<ImageRequest> turn_of(const ViewState& state, const Clip& clip, std::uint32_t samples) {
    ViewState shown = state;
    shown.comparison = Comparison::kOff;
    shown.box_depth = -1;
    shown.samples = std::min(state.samples, samples);
    std::vector<ImageRequest> requests;
    const std::vector<double> frames = recorded_frames(clip);
    if (frames.size() == 1) {
        for (int i = 0; i < kOrbitImages; ++i) {
            shown.camera = state.camera;
            shown.camera.orbit(2 * std::numbers::pi * i / kOrbitImages, 0);
            requests.push_back(request_of(shown, last_step(shown)));
        }
        return requests;
    }
    for (const double frame : frames) {
        shown.playback.seek(frame);
        requests.push_back(request_of(shown, last_step(shown)));
    }
    return requests;
}

Recording::Recording(const ViewState& state, const Clip& clip, const Options& options,
                     std::uint32_t samples)
    : options_(options),
      requests_(turn_of(state, clip, samples)),
      labels_(labels_of(clip, requests_.size())),
      rate_(static_cast<std::uint32_t>(std::max(std::lround(state.playback.frames_a_second), 1L))),
      folder_(free_folder()) {
    film_file_ = film_of(folder_.path());
}

Recording::~Recording() {
    const EndOfGrace end;
    cancel_ = true;
    if (film_.valid()) film_.wait();
}

fs::path Recording::file_of(std::size_t image) const {
    return folder_.path() / fmt::format("frame_{}.png", labels_[image]);
}

const ImageRequest* Recording::wanted() const {
    return written_ < requests_.size() ? &requests_[written_] : nullptr;
}

void Recording::add(const TracedImage& image) {
    if (image.panes.empty()) throw Error(ErrorKind::kUnavailable, image.error);
    const TracedPane& pane = image.panes.front();
    const Image pixels{pane.width, pane.height, pane.pixels};
    write_file(file_of(written_),
               encode_png(pixels, pixel_texts(render_options(options_, image.request, pane.tree),
                                              image.request.frame, pixels.pixels)));
    ++written_;
    if (wanted() != nullptr || !can_write_videos()) return;
    film_ = std::async(std::launch::async, [this] {
        std::vector<fs::path> files;
        for (std::size_t i = 0; i < requests_.size(); ++i) files.push_back(file_of(i));
        write_video(film_file_, rate_, files, cancel_);
    });
}

bool Recording::is_done() {
    if (wanted() != nullptr) return false;
    if (!film_.valid()) return true;
    if (film_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
    film_.get();
    has_film_ = true;
    return true;
}

std::string Recording::activity() const {
    if (wanted() == nullptr) return "writing " + film_file_.native();
    return fmt::format("recording {} of {}", written_ + 1, requests_.size());
}

std::string Recording::summary() const {
    if (written_ == 0) return "no image is written";
    std::string text = fmt::format("{} image{} in {}", written_, written_ == 1 ? "" : "s",
                                   folder_.path().native());
    if (has_film_) return text + fmt::format(", film {}", film_file_.native());
    if (wanted() == nullptr && !can_write_videos())
        text += "; no film, because ffmpeg is not on the PATH";
    return text;
}

}  // namespace mray::app
