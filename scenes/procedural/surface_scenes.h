// Built-in scenes of surfaces that bend: cloth, herd, spikes.
#pragma once

#include "scenes/procedural/surfaces.h"

namespace mray {

// `triangles` is about how many to make; a scene has at least as many as its shape needs.

DeformingMesh make_cloth(std::uint64_t triangles);
/// The hills are at least half of the triangles.
DeformingMesh make_herd(std::uint64_t triangles);
/// One closed mesh, star-shaped around the origin, so that each ray from there must hit.
DeformingMesh make_spikes(std::uint64_t triangles);

}  // namespace mray
