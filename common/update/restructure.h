// Builds new levels of a tree over the subtrees that are still sound.
#pragma once

#include "common/bvh/builder/layout.h"

namespace mray {

/// The areas of a tree as it is.
BuiltAreas built_areas(const Bvh& bvh);

/// Builds new levels over the largest sound subtrees, in which no box has grown by more than
/// kSoundGrowth (beyond `growth`, that of the triangles themselves), and the triangles of all other
/// leaves: those with triangles of several bodies grow, with the nodes above them. If they have
/// more than `most` of all triangles, only the leaves that have grown most are taken, so that a
/// long restructuring can be done in slices. Runs in the calling thread's arena.
///
/// The boxes and vertices of the tree must be those of the pose. Writes nodes, parents, levels, new
/// leaves (in the places of removed ones, or at the end) and `areas`. Afterwards nodes are in
/// breadth-first order, leaves are not. The result depends only on the arguments. Returns the
/// number of subtrees and triangles under the new levels. Returns 0, and changes nothing, if all is
/// sound, if a build would not cost much more, or if the tree would become too deep.
///
/// Based on: S. Yoon, S. Curtis, D. Manocha. Ray tracing dynamic scenes using selective
/// restructuring. EGSR 2007; there pairs of nodes are restructured in turn.
std::size_t restructure(const Topology& topology, std::span<const vec3> positions, double growth,
                        double most, Bvh& bvh, BuiltAreas& areas);

/// The largest growth of a sound box: a flat square that turns about its edge has up to 1.9.
inline constexpr double kSoundGrowth = 2;

}  // namespace mray
