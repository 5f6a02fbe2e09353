// CGAL's AABB_tree without exact arithmetic, with the tree of vertices for first guesses.
#pragma once

#include <string>

#include "lab/bench/bench_scene.h"
#include "lab/methods/closest_point.h"

namespace mray::lab {

struct CgalPeer {
    /// "CGAL 5.5.1 AABB_tree"
    std::string name = {};
    /// By closest_point_and_primitive(). Empty without CGAL's headers or without triangles.
    FindClosest find_closest = {};
};
#ifdef MORPHRAY_CGAL
CgalPeer make_cgal_peer(const BenchScene& scene);
#else
inline CgalPeer make_cgal_peer(const BenchScene&) { return {}; }
#endif

}  // namespace mray::lab
