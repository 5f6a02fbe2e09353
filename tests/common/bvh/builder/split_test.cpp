#include "common/bvh/builder/split.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "common/base/aligned_vector.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using test::Random;

/// Boxes of any size in a region that may be flat or a point; some are empty.
AlignedVector<PrimRef> random_refs(Random& random, std::uint32_t count) {
    vec3 region;
    for (int axis = 0; axis < 3; ++axis)
        region[axis] = random.below(4) == 0 ? 0 : std::ldexp(1.0f, random.below(20));
    const float size = std::ldexp(1.0f, static_cast<int>(random.below(20)) - 5);
    const bool in_steps = random.below(3) == 0;
    AlignedVector<PrimRef> refs;
    for (std::uint32_t id = 0; id < count; ++id) {
        Box box;
        for (int i = 0; i < 3 && random.below(100) != 0; ++i) {
            vec3 p = random.point() * region + (i == 0 ? vec3(0, 0, 0) : random.point(size));
            if (in_steps) p = {std::round(p.x), std::round(p.y), std::round(p.z)};
            box.extend(snap_point(p));
        }
        refs.push_back(PrimRef(box, id));
    }
    return refs;
}

/// Half the area of the union of the boxes, times the number of refs and 12 more (kPartCost).
float part_cost(std::span<const PrimRef> refs) {
    Box box;
    for (const PrimRef& ref : refs) box.extend(ref.box());
    if (box.empty()) return 0;
    const vec3 d = box.upper - box.lower;
    return (d.x * d.y + d.y * d.z + d.z * d.x) * static_cast<float>(refs.size() + 12);
}

using SplitFunction = std::size_t (*)(std::span<const PrimRef>, PrimRef*, const SimdTarget&);

/// Expects the same result of every target; returns the size of the first part.
std::size_t expect_same_on_every_target(SplitFunction split, std::span<const PrimRef> refs) {
    AlignedVector<PrimRef> expected(refs.size(), PrimRef(Box(), 0));
    const std::size_t left = split(refs, expected.data(), best_simd_target());
    for (const SimdTarget& target : supported_simd_targets()) {
        AlignedVector<PrimRef> out(refs.size(), PrimRef(Box(), 0));
        EXPECT_EQ(split(refs, out.data(), target), left) << target.name;
        EXPECT_EQ(std::memcmp(out.data(), expected.data(), refs.size_bytes()), 0) << target.name;
    }
    return left;
}

TEST(Splits, HaveTheSameResultOnEveryTarget) {
    Random random(1);
    std::size_t divided = 0;
    for (int round = 0; round < 600; ++round) {
        const std::uint32_t many = 16000 + random.below(30000);
        const std::uint32_t few = 2 + random.below(round % 2 == 0 ? 60 : 2000);
        const std::uint32_t count = round % 40 == 0 ? many : few;
        divided += expect_same_on_every_target(split_binned, random_refs(random, count)) != 0;
        divided += expect_same_on_every_target(
                       split_few, random_refs(random, 2 + random.below(kFewRefs - 1))) != 0;
    }
    EXPECT_GT(divided, 800u);
}

TEST(Splits, OfFewRefsAreTheCheapestOfAllPositions) {
    Random random(2);
    for (int round = 0; round < 300; ++round) {
        const AlignedVector<PrimRef> refs = random_refs(random, kFewRefs);
        Split cheapest;
        std::vector<PrimRef> order(refs.begin(), refs.end());
        for (int axis = 0; axis < 3; ++axis) {
            std::sort(order.begin(), order.end(), [=](const PrimRef& a, const PrimRef& b) {
                return std::pair(a.centroid2(axis), a.prim_id()) <
                       std::pair(b.centroid2(axis), b.prim_id());
            });
            if (order.front().centroid2(axis) == order.back().centroid2(axis)) continue;
            for (std::size_t i = 1; i < kFewRefs; ++i) {
                cheapest.consider(
                    {part_cost(std::span(order).first(i)) + part_cost(std::span(order).subspan(i)),
                     axis, i, i});
            }
        }
        AlignedVector<PrimRef> out(kFewRefs, PrimRef(Box(), 0));
        const std::size_t left = split_few(refs, out.data());
        ASSERT_EQ(left, cheapest.left_size) << round;
    }
}

}  // namespace
}  // namespace mray
