// The boxes of a node that a packet meets, on every target.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/interop/constants.h"
#include "common/simd/simd_target.h"
#include "cpu/packet/packets.h"
#include "tests/support/test_scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/cpu/packet/packet_node_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/packet/packet_plane-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR

// It has no packets.
std::size_t count_too_narrow(std::size_t, std::uint64_t) { return 0; }
#else

/// A frame at an origin in or around the scene, whose axes are neither orthogonal nor of one
/// length.
PacketFrame random_frame(test::Random& random) {
    PlaneAxes axes;
    for (glm::dvec3* axis : {&axes.x, &axes.y, &axes.z}) {
        const double size = std::ldexp(1.0, static_cast<int>(random.below(12)) - 10);
        for (int k = 0; k < 3; ++k) (*axis)[k] = size * random.real(-1, 1);
    }
    PacketFrame frame;
    const vec3 org = random.point(random.below(2) == 0 ? 1 : 3 * kSceneExtent);
    set_frame(frame, org, axes, 33);
    return frame;
}

/// The boxes among `count` random ones whose bounds leave out a point of the box, or a point off it
/// by as much as the hit rule displaces a vertex (project_boxes, step 2).
std::size_t count_too_narrow(std::size_t count, std::uint64_t seed) {
    constexpr double kDisplaced = 8 * 0x1p-24;
    test::Random random(seed);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const PacketFrame frame = random_frame(random);
        HWY_ALIGN float bounds[2][3][kLanes];
        HWY_ALIGN float sizes[kLanes];
        for (std::size_t l = 0; l < kLanes; ++l) {
            const double extent = std::ldexp(1.0, static_cast<int>(random.below(24)));
            const double thickness = std::ldexp(1.0, -static_cast<int>(random.below(30)));
            sizes[l] = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const double lower = extent * random.real(-1, 1);
                const double upper = lower + extent * thickness * random.real(0, 1);
                bounds[0][axis][l] = static_cast<float>(lower);
                bounds[1][axis][l] = std::max(static_cast<float>(upper), bounds[0][axis][l]);
                for (const auto& bound : bounds)
                    sizes[l] = std::max(sizes[l], std::abs(bound[axis][l]));
            }
        }
        const FloatVec lower[3] = {load(bounds[0][0]), load(bounds[0][1]), load(bounds[0][2])};
        const FloatVec upper[3] = {load(bounds[1][0]), load(bounds[1][1]), load(bounds[1][2])};
        for (int k = 0; k < 3; ++k) {
            FloatVec least_of_all, most_of_all;
            project_boxes(frame, k, lower, upper, load(sizes), least_of_all, most_of_all);
            HWY_ALIGN float least[kLanes];
            HWY_ALIGN float most[kLanes];
            store(least_of_all, least);
            store(most_of_all, most);
            for (std::size_t l = 0; l < kLanes; ++l) {
                long double from = 0, to = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const long double row = frame.rows[k][axis];
                    const long double a = row * bounds[0][axis][l], b = row * bounds[1][axis][l];
                    from += std::min(a, b);
                    to += std::max(a, b);
                }
                const long double off = kDisplaced * frame.row_size[k] * sizes[l];
                wrong += !(least[l] <= from - off && most[l] >= to + off);
            }
        }
    }
    return wrong;
}

#endif  // HWY_TARGET

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(count_too_narrow);
TEST(PacketNode, BoundsOfBoxesHoldDisplacedVertices) {
    for (const SimdTarget& target : supported_simd_targets())
        EXPECT_EQ(SIMD_FUNCTION(count_too_narrow, target)(4000, 7), 0u) << target.name;
}

}  // namespace
}  // namespace mray::cpu

#endif  // HWY_ONCE
