// Views of clips that are closed.
#pragma once

#include <optional>

#include "common/scene/camera_setup.h"
#include "scenes/clip.h"

namespace mray {

/// The view with the eye and the target of the clip's inside_view(), if it has one and neither is
/// given, and with its light, if none is given.
inline ViewSpec with_inside_view(ViewSpec view, const Clip& clip) {
    const std::optional<InsideView> inside = clip.inside_view();
    if (!inside) return view;
    if (!view.eye && !view.target) {
        view.eye = inside->eye;
        view.target = inside->target;
    }
    if (!view.light) view.light = inside->light;
    return view;
}

}  // namespace mray
