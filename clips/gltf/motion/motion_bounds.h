// A box around a glTF scene at all times.
#pragma once

#include <cstdint>

#include "clips/gltf/motion/skinning.h"
#include "common/base/watch.h"
#include "common/scene/world_bounds.h"

namespace mray::gltf {

struct MotionBounds {
    WorldBounds bounds;
    /// A vertex that cannot be used (Skinning::place) and the time in seconds; kNoVertex if all can
    /// that were looked at.
    std::size_t bad_vertex = kNoVertex;
    double bad_time = 0;
};

/// Bounds that hold every vertex at every time of the animation: those at a series of times,
/// widened by how far a vertex may leave the straight line between two of them (derivation in
/// motion_bounds.cpp). The series are the times of the keys and, where that widening is above 1/256
/// of the diagonal, times between. Clips of more than 2^29 vertices at their keys get a box around
/// all that their joints can reach instead. Throws Error(kCancelled) between two times if the watch
/// asks for it.
MotionBounds motion_bounds(const GltfScene& scene, const Skinning& skinning,
                           const Watch& watch = {});

}  // namespace mray::gltf
