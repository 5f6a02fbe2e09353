#include "lab/methods/peer_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <glm/common.hpp>

#include "common/bvh/builder/binary_tree.h"

namespace mray::lab {
namespace {

/// Turns the builder's binary tree, whose leaves are single triangles, into a peer's.
struct PeerBuilder {
    const Topology& topology;
    std::span<const vec3> positions;
    double node_cost;
    std::uint32_t most_triangles;
    BinaryTree from;
    PeerTree to = {};

    void set_node(std::uint32_t at, const BinaryNode& node) {
        PeerNode made{node.box.lower, 0, node.box.upper, 0, 0};
        if (is_leaf(node)) {
            made.first = static_cast<std::uint32_t>(to.triangles.size());
            made.count = node.size() & 0x3FFFFFFFu;
            for (const std::uint32_t id : from.triangles(node)) {
                const uvec3 t = topology.triangles[id];
                to.triangles.push_back({positions[t.x], positions[t.y], positions[t.z], id});
            }
            to.nodes[at] = made;
            return;
        }
        const BinaryNode& left = from.nodes[node.children];
        const BinaryNode& right = from.nodes[node.children + 1];
        const vec3 way = (right.box.lower - left.box.lower) + (right.box.upper - left.box.upper);
        int axis = 0;
        for (int other = 1; other < 3; ++other)
            if (std::fabs(way[other]) > std::fabs(way[axis])) axis = other;
        made.axis = static_cast<std::uint32_t>(axis) & 3u;
        made.first = static_cast<std::uint32_t>(to.nodes.size());
        to.nodes[at] = made;
        to.nodes.resize(to.nodes.size() + 2);
        const bool is_swapped = way[axis] < 0;
        set_node(made.first, is_swapped ? right : left);
        set_node(made.first + 1, is_swapped ? left : right);
    }

    /// Whether few triangles cost no more than a node.
    bool is_leaf(const BinaryNode& node) const {
        if (node.is_leaf()) return true;
        if (node.size() > most_triangles) return false;
        const auto cost = [](const BinaryNode& n) { return half_area(n.box) * n.size(); };
        return cost(node) <= cost(from.nodes[node.children]) + cost(from.nodes[node.children + 1]) +
                                 node_cost * half_area(node.box);
    }
};

}  // namespace

PeerTree build_peer_tree(const Topology& topology, std::span<const vec3> positions,
                         double node_cost, std::uint32_t most_triangles) {
    AlignedVector<PrimRef> refs;
    for (std::uint32_t id = 0; id < topology.triangles.size(); ++id) {
        const uvec3 t = topology.triangles[id];
        Box box;
        for (int k = 0; k < 3; ++k) box.extend(positions[t[k]]);
        // A vertex that is not finite has the largest coordinates of all.
        if (is_finite_vertex(box.upper)) refs.emplace_back(box, id);
    }
    // Without triangles in the topology each ref is a part, which is a leaf of its own.
    PeerBuilder builder{topology, positions, node_cost, most_triangles,
                        build_binary_tree(Topology{}, std::move(refs))};
    if (builder.from.nodes.empty()) return {};
    builder.to.nodes.emplace_back();
    builder.set_node(0, builder.from.nodes.front());
    return std::move(builder.to);
}

void refit(PeerTree& tree, const Topology& topology, std::span<const vec3> positions) {
    using Range = tbb::blocked_range<std::size_t>;
    constexpr std::size_t kGrain = 1024;
    tbb::parallel_for(Range(0, tree.nodes.size(), kGrain), [&](const Range& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            PeerNode& node = tree.nodes[n];
            if (node.count == 0) continue;
            Box box;
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                PeerTriangle& triangle = tree.triangles[i];
                const uvec3 t = topology.triangles[triangle.prim_id];
                triangle = {positions[t.x], positions[t.y], positions[t.z], triangle.prim_id};
                for (const vec3& corner : {triangle.a, triangle.b, triangle.c}) box.extend(corner);
            }
            node.lower = box.lower;
            node.upper = box.upper;
        }
    });
    // Children come after their parents.
    for (std::size_t n = tree.nodes.size(); n-- > 0;) {
        PeerNode& node = tree.nodes[n];
        if (node.count > 0) continue;
        const PeerNode& left = tree.nodes[node.first];
        const PeerNode& right = tree.nodes[node.first + 1];
        node.lower = glm::min(left.lower, right.lower);
        node.upper = glm::max(left.upper, right.upper);
    }
}

}  // namespace mray::lab
