// What a trace produces.
#pragma once

#include <cstdint>
#include <vector>

#include "common/interop/params.h"
#include "common/interop/ray.h"

namespace morphray {

/// One traced image, row by row from the top. occlusion holds, for pixels whose ray hit something,
/// the number of occluded secondary rays; it is 0 elsewhere, and for primary images everywhere.
struct Frame {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<Hit> hits;
    std::vector<std::uint32_t> occlusion;
    std::vector<std::uint32_t> pixels;
};

/// XXH3 (64 bits) of hits and occlusion, and of the pixels.
std::uint64_t hits_hash(const Frame& frame);
std::uint64_t image_hash(const Frame& frame);

}  // namespace morphray
