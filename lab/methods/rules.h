// Intersection rules from the literature, each as its authors give it, one ray at a time in one
// plain binary tree with padded slabs, so that methods differ in the rule alone.
#pragma once

#include "lab/methods/peer_tree.h"
#include "lab/methods/tracers.h"

namespace mray::lab {

/// "Moeller-Trumbore" (T. Moeller, B. Trumbore. Fast, Minimum Storage Ray/Triangle Intersection.
/// 1997), "Woop" (S. Woop, C. Benthin, I. Wald. Watertight Ray/Triangle Intersection. 2013),
/// "Baldwin-Weber" (D. Baldwin, M. Weber. Fast Ray-Triangle Intersections by Coordinate
/// Transformation. 2016), all in float, and "double": the first of them in doubles. The tree
/// outlives the tracers.
std::vector<Tracer> rule_tracers(const PeerTree& tree, const RaySet& set);

}  // namespace mray::lab
