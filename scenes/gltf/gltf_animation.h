// An animation from a glTF 2.0 file.
#pragma once

#include <filesystem>

#include "scenes/animation.h"

namespace mray {

/// Frames that are shown a second unless AnimationOptions::fps says so.
inline constexpr double kDefaultFps = 24;

/// Whether the name ends with .gltf or .glb, in any case.
bool has_gltf_name(const std::filesystem::path& path);

/// Opens a .gltf or .glb file. Frame f of an animation is at f / fps seconds; without one there is
/// frame 0. Throws Error: kBadInput with the place in the JSON, kBadArgument, kLimit.
std::unique_ptr<Animation> open_gltf(const std::filesystem::path& path, const std::string& name,
                                     const AnimationOptions& options);

}  // namespace mray
