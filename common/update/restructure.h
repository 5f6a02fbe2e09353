// Builds new levels of a tree over the parts that are still sound.
#pragma once

#include <cstddef>
#include <span>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"
#include "common/update/relayout.h"

namespace mray {

/// Often only a small part of a tree degrades: bodies that move as a whole keep their subtrees
/// sound, and only leaves with triangles of several bodies grow, with the nodes above them.
/// Restructuring takes the largest sound subtrees, in which no box has grown by more than
/// kSoundGrowth (beyond `growth`, that of the triangles themselves), and the triangles of all other
/// leaves. If those have more than `most` of all triangles, it takes only the leaves that have
/// grown most, so that a long restructuring can be done in slices: what has grown less counts as
/// sound. It builds a tree over these, and keeps the subtrees below it as they are.
///
/// The boxes and vertices of the tree must be those of the pose. Writes nodes, parents, levels, new
/// leaves (in the places of removed ones, or at the end) and `areas`. Afterwards nodes are in
/// breadth-first order, leaves are not. The result depends only on the arguments. Returns the
/// number of subtrees and triangles under the new levels. Returns 0, and changes nothing, if all is
/// sound, if a build would not cost much more, or if the tree would become deeper than kMaxDepth.
/// Runs in the calling thread's arena.
///
/// Based on: S. Yoon, S. Curtis, D. Manocha. Ray tracing dynamic scenes using selective
/// restructuring. EGSR 2007. They restructure pairs of nodes in turn; here all degraded parts are
/// restructured at once.
std::size_t restructure(const Topology& topology, std::span<const vec3> positions, double growth,
                        double most, Bvh& bvh, BuiltAreas& areas);

/// The largest growth of a sound box: a flat square that turns about its edge has up to 1.9.
inline constexpr double kSoundGrowth = 2;

}  // namespace mray
