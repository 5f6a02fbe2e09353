// Measures how well a tree fits its triangles, fast enough for every frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/scene/mesh.h"

namespace mray {

/// The surface area heuristic: the sum of half the areas of all nodes' boxes, plus kLeafCost times
/// that of the leaves' boxes, in scene units squared. It is not divided by the root's area, because
/// the cost of a box in an image depends on its size there. Finite; 0 for a tree over no triangles.
/// Equal bytes of nodes give equal bits.
double tree_cost(std::span<const Node> nodes);

/// At most kMost triangles, evenly by prim_id: their area tells grown triangles from a bad tree.
class TriangleSample {
public:
    explicit TriangleSample(const Topology& topology);

    /// The sum of half the areas of the boxes of sampled triangles that are finite; 0 for none.
    double area(std::span<const vec3> positions) const;

private:
    static constexpr std::size_t kMost = 4096;
    std::vector<uvec3> triangles_;
};

/// The cost of a tree, the size of its triangles and half the area of its root at one pose.
struct TreeFit {
    double cost = 0;
    double triangle_area = 0;
    double root_area = 0;
};
TreeFit tree_fit(std::span<const Node> nodes, double triangle_area);

/// The factor by which the tree fits worse now than when it was built: the ratio of the costs, each
/// divided by the triangles' size if both sizes are above 0. 1 if both costs are 0; infinite if
/// only that of the build is 0 (a tree that was built in a point); never negative.
double cost_ratio(const TreeFit& built, const TreeFit& now);

/// The visits of nodes (a leaf counts as kLeafCost) that a ray through the root makes now, on
/// average, beyond those of a tree as good as the built one was: the growth of the cost beyond that
/// of the triangles, divided by the root's area. 0 if the tree has not become worse, or if the root
/// has no area; finite.
double overhead_visits(const TreeFit& built, const TreeFit& now);

}  // namespace mray
