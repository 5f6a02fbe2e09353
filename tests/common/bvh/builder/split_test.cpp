#include "common/bvh/builder/split.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "common/base/aligned_vector.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using test::Random;

/// Boxes of any size in a region that may be flat or a point; some are empty, and some pairs.
AlignedVector<PrimRef> random_refs(Random& random, std::uint32_t count) {
    vec3 region;
    for (int axis = 0; axis < 3; ++axis)
        region[axis] = random.below(4) == 0 ? 0 : std::ldexp(1.0f, random.below(20));
    const float size = std::ldexp(1.0f, static_cast<int>(random.below(20)) - 5);
    const bool in_steps = random.below(3) == 0;
    const bool with_pairs = random.below(2) == 0;
    AlignedVector<PrimRef> refs;
    for (std::uint32_t id = 0; id < count; ++id) {
        Box box;
        for (int i = 0; i < 3 && random.below(100) != 0; ++i) {
            vec3 p = random.point() * region + (i == 0 ? vec3(0, 0, 0) : random.point(size));
            if (in_steps) p = {std::round(p.x), std::round(p.y), std::round(p.z)};
            box.extend(snap_point(p));
        }
        refs.push_back(PrimRef(box, 2 * id));
        if (with_pairs && random.below(3) != 0) refs.back().make_pair_of(2 * id);
    }
    return refs;
}

std::size_t triangles_of(std::span<const PrimRef> refs) {
    std::size_t sum = 0;
    for (const PrimRef& ref : refs) sum += ref.triangle_count();
    return sum;
}

using SplitFunction = PartSize (*)(std::span<const PrimRef>, PrimRef*, const SimdTarget&);

/// Expects the same result of every target, which has all refs in order; returns whether it
/// divides.
bool expect_same_on_every_target(SplitFunction split, std::span<const PrimRef> refs) {
    const std::size_t room = triangles_of(refs);
    AlignedVector<PrimRef> expected(room, PrimRef(Box(), 0));
    const PartSize left = split(refs, expected.data(), best_simd_target());
    for (const SimdTarget& target : supported_simd_targets()) {
        AlignedVector<PrimRef> out(room, PrimRef(Box(), 0));
        const PartSize size = split(refs, out.data(), target);
        EXPECT_EQ(size.refs, left.refs) << target.name;
        EXPECT_EQ(size.triangles, left.triangles) << target.name;
        EXPECT_EQ(std::memcmp(out.data(), expected.data(), room * sizeof(PrimRef)), 0)
            << target.name;
    }
    if (left.refs == 0) return false;
    const std::span all(expected);
    EXPECT_EQ(triangles_of(all.first(left.refs)), left.triangles);
    std::vector<PrimRef> merged(refs.size(), PrimRef(Box(), 0));
    std::merge(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(left.refs),
               all.begin() + static_cast<std::ptrdiff_t>(left.triangles),
               all.begin() + static_cast<std::ptrdiff_t>(left.triangles + refs.size() - left.refs),
               merged.begin(),
               [](const PrimRef& a, const PrimRef& b) { return a.prim_id() < b.prim_id(); });
    EXPECT_EQ(std::memcmp(merged.data(), refs.data(), refs.size_bytes()), 0);
    return true;
}

TEST(Splits, HaveTheSameResultOnEveryTarget) {
    Random random(1);
    std::size_t divided = 0;
    for (int round = 0; round < 600; ++round) {
        const std::uint32_t many = 16000 + random.below(30000);
        const std::uint32_t few = 2 + random.below(round % 2 == 0 ? 60 : 2000);
        const std::uint32_t count = round % 40 == 0 ? many : few;
        divided += expect_same_on_every_target(split_binned, random_refs(random, count)) ? 1 : 0;
        divided += expect_same_on_every_target(split_median, random_refs(random, few)) ? 1 : 0;
    }
    EXPECT_GT(divided, 1000u);
}

/// A row of small boxes, and a large one about the middle of them.
AlignedVector<PrimRef> row_with_a_beam(std::uint32_t count, std::uint32_t beam) {
    AlignedVector<PrimRef> refs;
    for (std::uint32_t id = 0; id < count; ++id) {
        const auto x = static_cast<float>(id);
        refs.push_back(PrimRef({{x, 0, 0}, {x + 1, 1, 1}}, id));
    }
    refs[beam] = PrimRef({{0, -4, -4}, {static_cast<float>(count), 5, 5}}, beam);
    return refs;
}

TEST(SplitByArea, DividesALargeBoxFromTheOthers) {
    const AlignedVector<PrimRef> refs = row_with_a_beam(100, 40);
    AlignedVector<PrimRef> out(refs.size(), PrimRef(Box(), 0));
    const PartSize by_bins = split_binned(refs, out.data());
    float largest = std::numeric_limits<float>::infinity();
    const PartSize by_area = split_by_area(refs, out.data(), refs.size(), by_bins, largest);
    EXPECT_EQ(largest, refs[40].area());
    ASSERT_EQ(by_area.refs, 1u);
    EXPECT_EQ(by_area.triangles, 1u);
    EXPECT_LT(by_area.cost, by_bins.cost);
    // Half areas 1881 and 201, times the triangles and 12.
    EXPECT_EQ(by_area.cost, 1881.0f * 13 + 201.0f * 111);
    EXPECT_EQ(out[0].prim_id(), 40u);
    for (std::uint32_t i = 1; i < 100; ++i) EXPECT_EQ(out[i].prim_id(), i <= 40 ? i - 1 : i);
}

TEST(SplitByArea, LeavesOtherSetsAlone) {
    AlignedVector<PrimRef> refs = row_with_a_beam(100, 40);
    refs[40] = PrimRef({{40, 0, 0}, {41, 1, 1}}, 40);
    AlignedVector<PrimRef> out(refs.size(), PrimRef(Box(), 0));
    const PartSize by_bins = split_binned(refs, out.data());
    const AlignedVector<PrimRef> divided = out;
    float largest = std::numeric_limits<float>::infinity();
    EXPECT_EQ(split_by_area(refs, out.data(), refs.size(), by_bins, largest).refs, 0u);
    EXPECT_EQ(std::memcmp(out.data(), divided.data(), refs.size() * sizeof(PrimRef)), 0);
}

TEST(PairRefs, AreNeighboursThatShareAnEdgeAndFillTheirBox) {
    // A triangle twice, whose second one is half a square; one that is elsewhere; two that meet in
    // an edge of a cube.
    const std::vector<vec3> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                         {0, 0, 1}, {9, 0, 0}, {9, 1, 0}, {9, 0, 1}};
    Topology topology;
    topology.triangles = {{0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {5, 6, 7}, {0, 1, 3}, {0, 1, 4}};
    topology.vertex_count = static_cast<std::uint32_t>(positions.size());
    AlignedVector<PrimRef> refs(topology.triangles.size(), PrimRef(Box(), 0));
    make_refs(topology, positions, 0, refs);
    ASSERT_EQ(pair_refs(topology, refs), 5u);
    const std::uint32_t ids[] = {0, 1, 3, 4, 5};
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_EQ(refs[i].prim_id(), ids[i]) << i;
        EXPECT_EQ(refs[i].triangle_count(), i == 1 ? 2u : 1u) << i;
    }
    EXPECT_EQ(refs[1].box(), (Box{{0, 0, 0}, {1, 1, 0}}));
}

}  // namespace
}  // namespace mray
