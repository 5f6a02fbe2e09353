// Views of clips that are closed.
#pragma once

#include "common/scene/camera_setup.h"
#include "scenes/clip.h"

namespace mray {

/// The view with the eye and the target of the clip's inside_view(), if it has one and neither is
/// given, and with its light, if none is given.
ViewSpec with_inside_view(ViewSpec view, const Clip& clip);

}  // namespace mray
