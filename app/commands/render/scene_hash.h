// Hashes of what an image shows, by which two runs know that they render the same scene.
#pragma once

#include <cstdint>
#include <span>

#include "scenes/clip.h"

namespace mray::app {

/// XXH3 (64 bits) of what all frames of a clip share: triangles, albedo, which corners look smooth
/// together, bounds, and with `with_textures` texture coordinates and the bytes of texture files.
/// Names of files do not matter. Throws Error(kBadInput) for a texture that cannot be read; one
/// that is missing with `lenient` counts as empty.
std::uint64_t clip_hash(const Clip& clip, bool with_textures, bool lenient);

/// The same for one frame: of a clip_hash() and the positions of all vertices.
std::uint64_t frame_hash(std::uint64_t clip_hash, std::span<const vec3> positions);

}  // namespace mray::app
