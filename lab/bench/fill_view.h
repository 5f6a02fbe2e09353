// The part of a scene that the image shows.
#pragma once

#include "common/bvh/bvh.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"

namespace mray::bench {

/// kWhole is the default camera, which keeps the whole clip in the image. kFill looks from the
/// same eye, by the same light, at the part of that image which is full, so that (nearly) every
/// pixel sees the scene. kInside is kFill in a scene that is closed: the eye and the light are in
/// it. kGiven is a view whose eye or target is given.
enum class ViewKind { kFill, kWhole, kInside, kGiven };

/// "fill", "whole", "inside", "given"
const char* name_of(ViewKind kind);

/// The view of kFill: `whole` with eye, target, fov and light set. `bvh` is the tree of the scene,
/// which decides which part of the image is full.
ViewSpec fill_view(const ViewSpec& whole, const WorldBounds& bounds, const SceneSpace& space,
                   const Bvh& bvh);

}  // namespace mray::bench
