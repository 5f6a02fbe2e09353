// The files that a render writes, and images of an earlier run that need not be rendered again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/clip/frames.h"
#include "common/image/png.h"
#include "scenes/clip.h"

namespace mray::app {

/// An image that is to be rendered.
struct FrameTask {
    double frame = 0;
    /// The name of its PNG file in the output folder.
    std::string file;
};

/// A folder for outputs. The destructor removes what it had to make of the path, if it is empty.
class OutputFolder {
public:
    /// Throws Error(kOutput) if files cannot be written into it.
    explicit OutputFolder(const std::filesystem::path& path);
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

private:
    /// From the innermost folder outwards.
    std::vector<std::filesystem::path> made_;
};

/// The folder that --out means; of one image its folder.
std::filesystem::path output_folder_of(const RenderOptions& options);

/// Throws Error(kBadArgument) if two frames would have one file.
void require_distinct_names(const RenderOptions& options, const std::vector<double>& frames,
                            const FrameDigits& digits);

/// The images of these frames.
std::vector<FrameTask> frame_tasks(const RenderOptions& options, const std::vector<double>& frames,
                                   const FrameDigits& digits);

/// Whether --hits names a folder, in which each frame has a file.
bool has_hits_folder(const RenderOptions& options);

/// Return the OpenEXR file of a task, and its file of hits if --hits names a folder. Empty: none.
std::filesystem::path exr_file_of(const RenderOptions& options, const std::filesystem::path& folder,
                                  const FrameTask& task);
std::filesystem::path hits_file_of(const RenderOptions& options, const FrameTask& task);

/// XXH3 (64 bits) of what all frames of a clip share: triangles, albedo, which corners look smooth
/// together, bounds, and with `with_textures` texture coordinates and the bytes of texture files.
/// Names of files do not matter. Throws Error(kBadInput) for a texture that cannot be read; one
/// that is missing with `lenient` counts as empty.
std::uint64_t clip_hash(const Clip& clip, bool with_textures, bool lenient);

/// The same for one frame: of a clip_hash() and the positions of all vertices.
std::uint64_t frame_hash(std::uint64_t clip_hash, std::span<const vec3> positions);

/// Reads the image of a task. Its PNG file must be readable, have the pixels of its own hash, and
/// name this version, these options and this scene (a frame_hash()); the other files of the frame
/// that the options ask for must be there. Otherwise returns nothing, and in `reason` why; empty if
/// there is no file.
std::optional<Image> read_existing(const RenderOptions& options,
                                   const std::filesystem::path& folder, const FrameTask& task,
                                   std::uint64_t scene_hash, std::string& reason);

}  // namespace mray::app
