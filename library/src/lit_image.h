// Images that the CPU shades for all backends: lit ones, false colours, several samples a pixel.
#pragma once

#include "common/base/watch.h"
#include "library/src/render.h"

namespace morphray::detail {

class SceneImpl;

/// Traces and shades a view in the CPU's shader. Throws as Scene::render().
void render_lit(SceneImpl& scene, const View& view, const mray::Watch& watch, TracedImage& traced,
                Image& image);

}  // namespace morphray::detail
