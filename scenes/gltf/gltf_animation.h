// An animation from a glTF 2.0 file.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "scenes/animation.h"

namespace mray {

/// Frames that are shown a second unless AnimationOptions::fps says so.
inline constexpr double kDefaultFps = 24;

/// Whether the name ends with .gltf or .glb, in any case.
bool has_gltf_name(const std::filesystem::path& path);

/// Opens a .gltf or .glb file. Frame f of an animation is at f / fps seconds; without one there is
/// frame 0. Throws Error: kBadInput with the place in the JSON, also for vertices that are not
/// finite or beyond 1e30 at frame 0 unless options.lenient; kBadArgument for an animation that is
/// not there; kLimit for a mesh above 2^28 triangles.
std::unique_ptr<Animation> open_gltf(const std::filesystem::path& path, const std::string& name,
                                     const AnimationOptions& options);

}  // namespace mray
