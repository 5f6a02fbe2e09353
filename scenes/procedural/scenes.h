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

/// A hollow sphere whose chunks, each a closed mesh, fly apart and turn.
DeformingMesh make_explode(std::uint64_t triangles);

/// As make_explode, but the chunks return; frame 12 is the farthest.
DeformingMesh make_gather(std::uint64_t triangles);

/// One torus in every frame, made of separate triangles that change places at each whole frame,
/// which degrades a refitted tree as fast as possible.
DeformingMesh make_shuffle(std::uint64_t triangles);

/// Small separate triangles that swing and turn.
DeformingMesh make_soup(std::uint64_t triangles);

/// A ball with pulsing spikes: one closed mesh, star-shaped around the origin, so that each ray
/// from there must hit.
DeformingMesh make_spikes(std::uint64_t triangles);

/// A closed mesh that shrinks to a plane (frames 2, 10, 18) and to a point (6, 14, 22), and expands
/// again to its full size (every fourth frame).
DeformingMesh make_collapse(std::uint64_t triangles);

/// A sheet that two waves run over; a refitted tree follows it without loss.
DeformingMesh make_wave(std::uint64_t triangles);

/// Balls on crossing orbits about a centre, so that neighbours change all the time.
DeformingMesh make_orbits(std::uint64_t triangles);

/// The same balls, all of which jump elsewhere at once at every third frame.
DeformingMesh make_teleport(std::uint64_t triangles);

/// The same balls, each a little aside in every odd frame: a rebuild just pays for itself, and the
/// old tree is sound again a frame later.
DeformingMesh make_swing(std::uint64_t triangles);

/// A closed hall with two rows of columns, long beams, thin cables and waving banners, to be seen
/// from inside: x from -20 to 20, y from 0 to 9, z from -7 to 7.
DeformingMesh make_hall(std::uint64_t triangles);

/// A closed room with a table, chairs of thin bars, lamps, many small things and a curtain that
/// moves, to be seen from inside: x from -5 to 5, y from 0 to 3, z from -3.5 to 3.5.
DeformingMesh make_room(std::uint64_t triangles);

/// A closed kitchen: large walls, cupboards, tiles, a blind of thin slats, stools, and hundreds of
/// vessels of small triangles, some near the eye; a towel sways. Fewer than 12000 triangles make
/// walls, vessels and the towel.
DeformingMesh make_kitchen(std::uint64_t triangles);

/// A ball with swaying hair: thin strips, each of 16 triangles and separate from the others.
DeformingMesh make_hair(std::uint64_t triangles);

/// The sheet of the scene wave, in which about half of the triangles have no area: needles along
/// edges of others, and points at their vertices.
DeformingMesh make_degenerate(std::uint64_t triangles);

}  // namespace mray
