#include "common/bvh/builder/vertex_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace mray {
namespace {

TEST(VertexSet, NumbersVerticesInTheOrderInWhichTheyComeWhateverTheirIndices) {
    std::mt19937 generator(1);
    const auto random = [&](std::uint32_t end) {
        return static_cast<std::uint32_t>(generator() % end);
    };
    for (int round = 0; round < 2000; ++round) {
        const std::uint32_t stride = 1u << random(28);  // equal digits collide
        const std::uint32_t different = 1 + random(3 * kLeafTriangles);
        VertexSet set;
        std::vector<std::uint32_t> expected;
        for (std::uint32_t i = 0; i < 3 * kLeafTriangles; ++i) {
            const std::uint32_t vertex = random(different) * stride;
            auto found = std::find(expected.begin(), expected.end(), vertex);
            if (found == expected.end()) found = expected.insert(found, vertex);
            ASSERT_EQ(set.add(vertex), found - expected.begin());
        }
        ASSERT_TRUE(std::equal(expected.begin(), expected.end(), set.vertices().begin(),
                               set.vertices().end()));
    }
}

}  // namespace
}  // namespace mray
