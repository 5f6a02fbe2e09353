// The answers of the parts of the single-ray tracer for some rays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/interop/bvh_layout.h"
#include "tests/support/test_scene.h"

namespace mray::cpu {

struct BoxAnswers {
    /// For each ray, by slots: met_slots, near_slots and its least depths.
    std::uint32_t met[64];
    std::uint32_t near[64];
    float t_least[64][kWidth];
    /// near_slots of all rays at once, and its least depths.
    std::uint32_t near_any;
    float least_of_all[kWidth];
    /// For each slot, by rays.
    std::uint64_t met_by[kWidth];
};

struct LeafCounts {
    std::size_t hits = 0;
    std::size_t certain = 0;
    std::size_t beyond = 0;
    std::size_t differences = 0;
};

/// Rays of all sorts, among them some along axes and one without a direction.
inline std::vector<Ray> rays_through(const test::TestScene& scene, std::size_t count,
                                     std::uint64_t seed) {
    std::vector<Ray> rays = test::mixed_rays(scene, count - 1, seed);
    rays.push_back({{1, 2, 3}, 0, {0, 0, 0}, kInfiniteT});
    return rays;
}

}  // namespace mray::cpu
