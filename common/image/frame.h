// A traced image with the hits that it was made from.
#pragma once

#include <algorithm>

#include "common/base/aligned_vector.h"
#include "common/base/hash.h"
#include "common/interop/camera.h"
#include "common/interop/ray.h"

namespace mray {

/// One image, row by row from the top. `occlusion` is the number of occluded secondary rays of each
/// pixel; it is 0 where the camera ray missed and in images without secondary rays.
struct Frame {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// Four hits are a cache line, which packets write at once.
    AlignedVector<Hit> hits;
    AlignedVector<std::uint32_t> occlusion, pixels;
    // Set by the caller.
    /// True if a backend fills `pixels`; otherwise they stay empty.
    bool with_pixels = true;
    /// If it is false, a device leaves `hits` and `occlusion` empty and saves a copy.
    bool with_hits = true;
    /// True if `hits` has the hits of these camera rays, so that the CPU does not trace them again.
    bool has_hits = false;
};

/// The secondary rays that a pixel with a hit is given; `rays` is that of ImageParams.
inline std::uint32_t rays_per_hit(std::uint32_t rays, std::uint32_t ao_count) {
    if (rays == kRaysShadow) return 1;
    return rays == kRaysAo ? ao_count : 0;
}

inline std::uint64_t count_hits(const Frame& frame) {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(frame.hits, [](const Hit& hit) { return hit.prim_id != kNoPrim; }));
}

/// XXH3 (64 bits) of hits and occlusion, and of the pixels.
inline std::uint64_t hits_hash(const Frame& frame) {
    return Hasher().add(frame.hits).add(frame.occlusion).digest();
}
inline std::uint64_t image_hash(std::span<const std::uint32_t> pixels) {
    return Hasher().add(pixels).digest();
}
inline std::uint64_t image_hash(const Frame& frame) { return image_hash(frame.pixels); }

}  // namespace mray
