// Images of an earlier run that need not be rendered again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "app/base/options.h"
#include "app/farm/frame_tasks.h"
#include "app/farm/part.h"
#include "common/image/png.h"

namespace mray::app {

/// An image that is there, with its pixels and what a part says of it.
struct ExistingImage {
    Image image;
    PartImage part;
};

/// Reads the image of a task. Its PNG file must be readable, have the pixels of its own hash, and
/// name this version, these options and this scene (a frame_hash()); the OpenEXR file that the
/// options ask for must be whole, and the file of hits the one that the image names. `earlier` is
/// the record of the image in the part of an earlier run, or null; files must have its hashes.
/// Otherwise returns nothing, and in `reason` why; empty if there is no file.
std::optional<ExistingImage> read_existing(const Options& options,
                                           const std::filesystem::path& folder,
                                           const FrameTask& task, std::uint64_t scene_hash,
                                           const PartImage* earlier, std::string& reason);

/// The PNG text with the file_hash() of a frame's file of hits.
inline constexpr const char* kHitsFileHash = "Hits file hash";

/// Name and hash of a file of a frame, relative to the folder of the part. Throws what InputFile
/// throws.
PartOutput output_of(const std::filesystem::path& folder, const std::filesystem::path& file);

/// XXH3 (64 bits) of the bytes of a file. Throws what InputFile throws.
std::uint64_t file_hash(const std::filesystem::path& file);

}  // namespace mray::app
