// How well a tree fits its triangles, cheap enough to be asked for every frame.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/bvh_layout.h"
#include "common/scene/mesh.h"

namespace morphray {

/// The surface area heuristic with the scene as it lies: the sum of half the areas of all nodes'
/// boxes plus kLeafCost times that of the leaves' boxes. Not divided by the root's area, because
/// what an image pays for a box goes by its size in the image. In scene units squared; 0 for a
/// tree over nothing. Finite. The same bits for the same bytes of nodes.
double tree_cost(std::span<const Node> nodes);

/// What a leaf is taken to cost, in visits of a node: its triangles (bvh_stats counts them, this
/// does not look at the leaves).
inline constexpr double kLeafCost = 12;

/// How large the triangles are, from a sample of them: tells a tree whose boxes grew because its
/// triangles did from one that has rotted. Sampled are at most kMost triangles, evenly by prim_id.
class TriangleSample {
public:
    explicit TriangleSample(const Topology& topology);

    /// The sum of half the areas of the sampled triangles' boxes (scene space); triangles with a
    /// vertex that is not finite count for nothing. 0 for no triangles.
    double area(std::span<const vec3> positions) const;

private:
    static constexpr std::size_t kMost = 4096;
    std::vector<uvec3> triangles_;
};

/// A tree's cost and its triangles' size at one pose.
struct TreeFit {
    double cost = 0;
    double triangle_area = 0;
};

/// How many times worse the tree fits now than when it was built: the costs' ratio, each over the
/// triangles' size where both have one. 1 while both costs are 0, infinite where only the build's
/// is 0 (a tree built in a point and then unfolded); never negative.
double cost_ratio(const TreeFit& built, const TreeFit& now);

}  // namespace morphray
