// The built-in scenes, one a file. Each takes about how many triangles to make and gives at least
// what the scene needs.
#pragma once

#include <cstdint>

#include "common/scene/procedural/deforming_mesh.h"

namespace morphray {

/// A sheet that comes down waving over a ball and hangs around it in folds, above a plane.
DeformingMesh make_cloth(std::uint64_t triangles);

/// A column of separate boxes with one end held and the other turned, evenly over the frames, by 0
/// to 4 turns; what is between turns in proportion to its height.
DeformingMesh make_twist(std::uint64_t triangles);

/// Animals that walk about rigidly on hills. The hills are the static triangles, at least half.
DeformingMesh make_herd(std::uint64_t triangles);

/// A hollow sphere whose chunks, each a closed mesh, fly apart and turn.
DeformingMesh make_explode(std::uint64_t triangles);

/// The same, and back to where they came from; frame 12 is the farthest.
DeformingMesh make_gather(std::uint64_t triangles);

/// One torus in every frame, made of separate triangles that change places at each whole frame:
/// the fastest way to spoil a tree that is only refitted.
DeformingMesh make_shuffle(std::uint64_t triangles);

/// Small separate triangles that swing and turn.
DeformingMesh make_soup(std::uint64_t triangles);

/// A ball with pulsing spikes: one closed mesh, star-shaped around the origin, so that each ray
/// from there must hit.
DeformingMesh make_spikes(std::uint64_t triangles);

/// A closed mesh that shrinks to a plane (frames 2, 10, 18) and to a point (6, 14, 22), and expands
/// again to its full size (every fourth frame).
DeformingMesh make_collapse(std::uint64_t triangles);

/// A sheet that two waves run over: what a refit follows without loss.
DeformingMesh make_wave(std::uint64_t triangles);

/// Balls on crossing orbits about a centre, so that what is near each other changes all the time.
DeformingMesh make_orbits(std::uint64_t triangles);

/// The same balls, all of which leap elsewhere at once at every third frame.
DeformingMesh make_teleport(std::uint64_t triangles);

/// The same balls, each a little aside in every odd frame: a tree that is hardly worth a new one,
/// and is sound again a frame later.
DeformingMesh make_swing(std::uint64_t triangles);

/// A closed mesh without symmetry that becomes its mirror image, inside out, through a plane at
/// frame 12.
DeformingMesh make_mirror(std::uint64_t triangles);

}  // namespace morphray
