// CGAL's AABB_tree as a peer, if its headers were found when the benchmark was built.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "lab/bench/bench_scene.h"
#include "lab/bench/query_work.h"

namespace mray::bench {

/// Triangles in Simple_cartesian<double>, without exact arithmetic.
class CgalTree {
public:
    virtual ~CgalTree() = default;

    /// "CGAL 5.5.1 AABB_tree"
    virtual std::string name() const = 0;
    /// By closest_point_and_primitive(), in the calling thread's arena.
    virtual void find_closest(std::span<const vec3> points,
                              std::span<NearestPoint> nearest) const = 0;
};

/// Built, with the tree of vertices that gives it first guesses; null without the headers, and for
/// a scene without triangles.
#ifdef MORPHRAY_CGAL
std::unique_ptr<CgalTree> make_cgal_tree(const BenchScene& scene);
#else
inline std::unique_ptr<CgalTree> make_cgal_tree(const BenchScene&) { return nullptr; }
#endif

}  // namespace mray::bench
