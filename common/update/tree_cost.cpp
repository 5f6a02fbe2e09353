#include "common/update/tree_cost.h"

#include <algorithm>
#include <limits>

#include "common/bvh/box.h"

namespace mray {

double tree_cost(std::span<const Node> nodes) {
    double node_area = 0;
    double leaf_area = 0;
    for (const Node& node : nodes) {
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            const double area = half_area(slot_box(node, slot));
            ((node.child[slot] & kLeafBit) != 0 ? leaf_area : node_area) += area;
        }
    }
    return half_area(node_box(nodes.front())) + node_area + kLeafCost * leaf_area;
}

TreeFit tree_fit(std::span<const Node> nodes, double triangle_area) {
    return {tree_cost(nodes), triangle_area, half_area(node_box(nodes.front()))};
}

TriangleSample::TriangleSample(const Topology& topology) {
    const std::size_t count = topology.triangles.size();
    const std::size_t step = std::max<std::size_t>(1, (count + kMost - 1) / kMost);
    for (std::size_t i = 0; i < count; i += step) triangles_.push_back(topology.triangles[i]);
}

double TriangleSample::area(std::span<const vec3> positions) const {
    double sum = 0;
    for (const uvec3& t : triangles_) {
        Box box;
        bool finite = true;
        for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
            finite = finite && is_finite_vertex(positions[vertex]);
            box.extend(positions[vertex]);
        }
        if (finite) sum += half_area(box);
    }
    return sum;
}

double cost_ratio(const TreeFit& built, const TreeFit& now) {
    if (built.cost <= 0) return now.cost > 0 ? std::numeric_limits<double>::infinity() : 1;
    const double growth = now.cost / built.cost;
    if (built.triangle_area <= 0 || now.triangle_area <= 0) return growth;
    return growth * (built.triangle_area / now.triangle_area);
}

double overhead_visits(const TreeFit& built, const TreeFit& now) {
    if (now.root_area <= 0) return 0;
    const bool known = built.triangle_area > 0 && now.triangle_area > 0;
    const double growth = known ? now.triangle_area / built.triangle_area : 1;
    return std::max(0.0, now.cost - growth * built.cost) / now.root_area;
}

}  // namespace mray
