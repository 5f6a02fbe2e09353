// A new tree over the parts of an old one that are still sound.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace morphray {

/// Half the area of the box of each node and leaf when the builder or a restructuring put it where
/// it is, over the growth by then.
struct BuiltAreas {
    std::vector<float> nodes;
    std::vector<float> leaves;
};
BuiltAreas built_areas(const Bvh& bvh);

/// What rots is often little of a tree: bodies that move as a whole keep their own subtrees sound,
/// and only leaves with triangles of several bodies, and the nodes above them, grow. Takes the
/// largest subtrees in which no box has grown by more than kSoundGrowth (beyond `growth`, by which
/// the triangles themselves have) and the triangles of the leaves that have, and builds a tree over
/// those; the subtrees go below it as they are.
///
/// The tree's boxes and vertices are those of the pose. Written are nodes, parents, levels, the
/// leaves that are new (in the places of those that are gone, or at the end) and `areas`.
/// Afterwards leaves are no longer in breadth-first order; nodes are. The result depends on the
/// arguments alone. Returns how many subtrees and triangles the new levels are made of; 0 if there
/// is nothing to do, or if the tree would become deeper than kMaxDepth, and then nothing has
/// changed. Runs in the calling thread's arena.
///
/// After: S. Yoon, S. Curtis, D. Manocha. Ray tracing dynamic scenes using selective restructuring.
/// EGSR 2007. There pairs of nodes are restructured in turn, here all that is degraded at once.
std::size_t restructure(const Topology& topology, std::span<const vec3> positions, double growth,
                        Bvh& bvh, BuiltAreas& areas);

/// Of areas. A flat square that turns about its own edge grows by up to 1.9 without any
/// degradation.
inline constexpr double kSoundGrowth = 2;

}  // namespace morphray
