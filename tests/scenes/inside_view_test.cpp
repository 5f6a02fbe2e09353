// Closed scenes are seen from inside.
#include "scenes/scene_frames.h"

#include <gtest/gtest.h>

#include <memory>

#include "scenes/procedural/procedural.h"

namespace mray {
namespace {

TEST(InsideView, IsThatOfClosedScenesUnlessAViewIsGiven) {
    for (const char* name : {"hall"}) {
        const std::unique_ptr<Animation> animation = make_procedural(name);
        const WorldBounds bounds = animation->bounds();
        ViewSpec view = world_view({}, *animation);
        ASSERT_TRUE(view.eye && view.target && view.light) << name;
        for (const Point& point : {*view.eye, *view.target, *view.light}) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                EXPECT_GT(point[axis], bounds.lower[axis]) << name;
                EXPECT_LT(point[axis], bounds.upper[axis]) << name;
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

}  // namespace
}  // namespace mray
