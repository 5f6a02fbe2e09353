#include "common/bvh/builder/split.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "common/base/aligned_vector.h"

namespace mray {
namespace {

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
