// The legend of images whose colours are numbers.
#pragma once

#include "common/image/depth.h"
#include "morphray/images.hpp"

namespace mray::app {

/// Draws a scale of depths, steps or looseness over the lower left corner of an image. Leaves
/// images of another shading, and those that are too small for it, as they are.
void draw_legend(morphray::Shading shading, const DepthRange& depths, morphray::Image& image);

}  // namespace mray::app
