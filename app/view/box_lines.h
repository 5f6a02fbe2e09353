// Boxes as lines over an image.
#pragma once

#include <span>
#include <vector>

#include "common/scene/camera_setup.h"
#include "morphray/geometry.hpp"

namespace mray::app {

/// A line in pixels from the upper left corner of the image. It may leave the image.
struct ImageLine {
    float x0 = 0;
    float y0 = 0;
    float x1 = 0;
    float y1 = 0;
};

/// The edges of the boxes as the camera sees them, without what is behind the eye. Eye and target
/// of the view are given.
std::vector<ImageLine> box_lines(const ViewSpec& view, std::span<const morphray::Box> boxes);

}  // namespace mray::app
