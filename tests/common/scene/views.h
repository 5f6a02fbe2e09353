// Views and bounds for tests of cameras.
#pragma once

#include <limits>

#include "common/scene/camera_setup.h"

namespace mray::test {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline WorldBounds box(double lower, double upper) {
    return {{lower, lower, lower}, {upper, upper, upper}};
}

inline ImageParams params_of(const ViewSpec& view, const WorldBounds& bounds) {
    return make_image_params(view, bounds, SceneSpace(bounds));
}

inline ViewSpec some_view() {
    ViewSpec view;
    view.eye = {3, 2, 5};
    view.target = {0.5, -0.25, 0.125};
    view.fov = 50;
    view.width = 101;
    view.height = 77;
    return view;
}

}  // namespace mray::test
