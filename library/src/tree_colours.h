// False colours that show what the tree costs.
#pragma once

#include "common/base/watch.h"
#include "library/src/render.h"

namespace morphray::detail {

/// Colours the samples of Shading::steps or Shading::sah; black without a hit, but for steps.
void colour_by_tree(SceneImpl& scene, Shading shading, const mray::Watch& watch,
                    TracedImage& image);

}  // namespace morphray::detail
