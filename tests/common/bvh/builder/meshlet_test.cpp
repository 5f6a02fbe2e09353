// How many different vertices fit into a leaf.
#include "common/bvh/builder/meshlet.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace mray {
namespace {

/// Triangles in a row, each with two vertices of the one before.
Topology strip(std::uint32_t triangles) {
    Topology topology;
    topology.vertex_count = triangles + 2;
    for (std::uint32_t i = 0; i < triangles; ++i) topology.triangles.emplace_back(i, i + 1, i + 2);
    return topology;
}

TEST(LeafShape, HoldsSixteenVerticesAndNoMore) {
    for (std::uint32_t count = 1; count <= kLeafTriangles; ++count) {
        const Topology topology = strip(count);
        std::vector<std::uint32_t> prim_ids(count);
        std::iota(prim_ids.begin(), prim_ids.end(), 0u);
        LeafShape shape;
        ASSERT_EQ(find_leaf_shape(topology, prim_ids, shape), count + 2 <= 16u) << count;
        if (count + 2 <= 16u) {
            EXPECT_EQ(shape.vertex_count, count + 2);
        }
    }
}

}  // namespace
}  // namespace mray
