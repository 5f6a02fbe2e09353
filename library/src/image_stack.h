// Stacks: many views of one size, of whose hits only some channels are kept.
#pragma once

#include <span>

#include "morphray/images.hpp"

namespace morphray::detail {

class SceneImpl;

/// Renders the views at the pose. Throws as Scene::render().
void render(SceneImpl& scene, std::span<const View> views, ImageStack& stack);

}  // namespace morphray::detail
