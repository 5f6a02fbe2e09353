// The built-in scenes, each in a file of its own. `triangles` is about how many triangles to make;
// a scene has at least as many as its shape needs.
#pragma once

#include <cstdint>

#include "scenes/procedural/deforming_mesh.h"

namespace mray {

/// A sheet that comes down waving over a ball and hangs around it in folds, above a plane.
DeformingMesh make_cloth(std::uint64_t triangles);

/// A column of separate boxes with one end held and the other turned, evenly over the frames, by 0
/// to 4 turns; boxes between the ends turn in proportion to their height.
DeformingMesh make_twist(std::uint64_t triangles);

/// Animals that walk about rigidly on hills. The hills are the static triangles, at least half.
DeformingMesh make_herd(std::uint64_t triangles);

/// One torus in every frame, made of separate triangles that change places at each whole frame,
/// which degrades a refitted tree as fast as possible.
DeformingMesh make_shuffle(std::uint64_t triangles);

/// Small separate triangles that swing and turn.
DeformingMesh make_soup(std::uint64_t triangles);

/// A ball with pulsing spikes: one closed mesh, star-shaped around the origin, so that each ray
/// from there must hit.
DeformingMesh make_spikes(std::uint64_t triangles);

/// Balls on crossing orbits about a centre, so that neighbours change all the time.
DeformingMesh make_orbits(std::uint64_t triangles);

/// The same balls, all of which jump elsewhere at once at every third frame.
DeformingMesh make_teleport(std::uint64_t triangles);

/// A closed hall with two rows of columns, long beams, thin cables and waving banners, to be seen
/// from inside: x from -20 to 20, y from 0 to 9, z from -7 to 7.
DeformingMesh make_hall(std::uint64_t triangles);

}  // namespace mray
