// Poses as they are read: the vertices that they change, and the space that they are in.
#include "library/src/scene/pose_reader.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "tests/library/scenes.h"

namespace morphray::detail {
namespace {

using mray::IndexRange;
using mray::test::UserMesh;
using Ranges = std::vector<IndexRange>;

/// Two meshes, a torus and then a sphere.
class Poses : public ::testing::Test {
protected:
    Poses() {
        list_.attach(torus_.view());
        list_.attach(sphere_.view());
        list_ = list_.changed();
        reader_.read_list(list_, nullptr, arena_);
    }
    const MeshPlace& place(std::uint32_t geom_id) const { return *list_.find(geom_id); }
    std::uint32_t vertex_count() const { return list_.topology().vertex_count; }

    UserMesh torus_ = UserMesh(mray::test::torus(12, 8));
    UserMesh sphere_ = UserMesh(mray::test::icosphere(2));
    MeshList list_;
    mray::ThreadArena arena_{1};
    PoseReader reader_{Box{{-8, -8, -8}, {8, 8, 8}}, mray::best_simd_target()};
};

TEST_F(Poses, ChangeTheVerticesThatAreRead) {
    const std::uint32_t first = place(1).first_vertex;
    EXPECT_EQ(reader_.read(list_, place(1), 3, 5, arena_), (Ranges{{first + 3, first + 8}}));
    EXPECT_EQ(reader_.read(list_, place(1), 3, 0, arena_), Ranges());
    EXPECT_EQ(reader_.read_deforming(list_, arena_), (Ranges{{0, first}, {first, vertex_count()}}));
}

TEST_F(Poses, ChangeAllVerticesWhileOneIsOutsideOfTheRange) {
    const Ranges all = {{0, vertex_count()}};
    const float inside = sphere_.points[4].x;
    sphere_.points[4].x = 1e6f;
    EXPECT_EQ(reader_.read(list_, place(1), 4, 1, arena_), all);
    // The space changes back to that of the bounds, so all vertices have other positions in it.
    sphere_.points[4].x = inside;
    EXPECT_EQ(reader_.read(list_, place(1), 4, 1, arena_), all);
    const std::uint32_t vertex = place(1).first_vertex + 4;
    EXPECT_EQ(reader_.read(list_, place(1), 4, 1, arena_), (Ranges{{vertex, vertex + 1}}));
}

}  // namespace
}  // namespace morphray::detail
