// Views and images between the public interface and the engine.
#pragma once

#include "common/image/frame.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "library/mesh_list.h"
#include "morphray/image.hpp"

namespace morphray::detail {

mray::ViewSpec to_spec(const View& view);

/// The frame that was traced with `params`, but for trace_ms.
Image to_image(mray::Frame frame, const mray::ImageParams& params, const mray::SceneSpace& space,
               const MeshList& meshes);

}  // namespace morphray::detail
