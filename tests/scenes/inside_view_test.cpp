// Closed scenes are seen from inside, files as objects.
#include "scenes/scene_frames.h"

#include <gtest/gtest.h>

#include <memory>

#include "scenes/procedural/procedural.h"
#include "tests/support/temporary_folder.h"

namespace mray {
namespace {

TEST(InsideView, IsThatOfClosedScenesUnlessAViewIsGiven) {
    for (const char* name : {"hall"}) {
        const std::unique_ptr<Animation> animation = make_procedural(name);
        const WorldBounds bounds = animation->bounds();
        ViewSpec view = world_view({}, *animation);
        ASSERT_TRUE(view.eye && view.target && view.light) << name;
        for (const Point& point : {*view.eye, *view.target, *view.light}) {
            const glm::dvec3 p = to_dvec3(point);
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_GT(p[axis], bounds.lower[axis]) << name;
                EXPECT_LT(p[axis], bounds.upper[axis]) << name;
            }
        }
        view = world_view({.target = Point{1, 2, 3}, .light = Point{4, 5, 6}}, *animation);
        EXPECT_EQ(view, (ViewSpec{.target = Point{1, 2, 3}, .light = Point{4, 5, 6}}));
        // The light stays inside.
        view = world_view({.eye = Point{1, 2, 3}}, *animation);
        EXPECT_FALSE(view.target);
        EXPECT_TRUE(view.light);
    }
    EXPECT_EQ(world_view({}, *make_procedural("cloth", 500)), ViewSpec{});
}

TEST(WorldView, FramesTheFirstFrameOfFiles) {
    const test::TemporaryFolder folder;
    folder.write("a_0.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("a_1.obj", "v 5 0 0\nv 6 0 0\nv 5 9 0\nf 1 2 3\n");
    const std::unique_ptr<Animation> animation = open_scene(folder.path());
    const vec3 first[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    EXPECT_EQ(world_view({}, *animation), frame_object({}, first));
    const ViewSpec given{.target = Point{1, 2, 3}};
    EXPECT_EQ(world_view(given, *animation), given);
}

}  // namespace
}  // namespace mray
