#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <limits>

#include <glm/common.hpp>

#include "lab/bench/paper_2007/paper_2007.h"

namespace mray::bench::paper_2007 {
namespace {

// Costs of testing a box and a triangle, relative to each other.
constexpr double kBoxCost = 1;
constexpr double kTriangleCost = 1;

struct Split {
    int axis = -1;
    /// The number of triangles of the lower child, in the order of the axis.
    std::size_t count = 0;
    double cost = std::numeric_limits<double>::infinity();
};

class Builder {
public:
    Builder(const Topology& topology, std::span<const vec3> positions)
        : topology_(topology), positions_(positions), boxes_(topology.triangles.size()) {
        for (std::uint32_t id = 0; id < boxes_.size(); ++id) {
            const uvec3 t = topology.triangles[id];
            bool finite = true;
            for (int i = 0; i < 3; ++i) {
                finite = finite && is_finite_vertex(positions[t[i]]);
                boxes_[id].extend(positions[t[i]]);
            }
            if (finite) ids_.push_back(id);
        }
        lower_areas_.resize(ids_.size());
    }

    Tree build() {
        if (ids_.empty()) return {};
        tree_.nodes.emplace_back();
        build(0, 0, ids_.size(), 0);
        return std::move(tree_);
    }

private:
    void build(std::uint32_t node, std::size_t begin, std::size_t end, int depth) {
        Box box;
        for (std::size_t i = begin; i < end; ++i) box.extend(boxes_[ids_[i]]);
        const Split split = best_split(box, begin, end);
        const std::size_t count = end - begin;
        if (!(split.cost < kTriangleCost * static_cast<double>(count)) || depth == kMaxDepth) {
            set_node(node, box, add_triangles(begin, end), count, 0);
            return;
        }
        sort(begin, end, split.axis);
        const auto children = static_cast<std::uint32_t>(tree_.nodes.size());
        tree_.nodes.resize(children + 2);
        set_node(node, box, children, 0, split.axis);
        build(children, begin, begin + split.count, depth + 1);
        build(children + 1, begin + split.count, end, depth + 1);
    }

    /// By the middles of their boxes.
    void sort(std::size_t begin, std::size_t end, int axis) {
        const auto first = ids_.begin() + static_cast<std::ptrdiff_t>(begin);
        tbb::parallel_sort(first, first + static_cast<std::ptrdiff_t>(end - begin),
                           [&](std::uint32_t i, std::uint32_t j) {
                               const float a = boxes_[i].lower[axis] + boxes_[i].upper[axis];
                               const float b = boxes_[j].lower[axis] + boxes_[j].upper[axis];
                               return a < b || (a == b && i < j);
                           });
    }

    void set_node(std::uint32_t node, const Box& box, std::uint32_t first, std::size_t count,
                  int axis) {
        Node& n = tree_.nodes[node];
        n.lower = box.lower;
        n.upper = box.upper;
        n.first = first;
        n.count = static_cast<std::uint32_t>(count) & 0x3FFFFFFFu;
        n.axis = static_cast<std::uint32_t>(axis) & 3u;
    }

    Split best_split(const Box& box, std::size_t begin, std::size_t end) {
        Split best;
        const double area = half_area(box);
        for (int axis = 0; axis < 3; ++axis) {
            sort(begin, end, axis);
            Box lower;
            for (std::size_t i = begin; i + 1 < end; ++i) {
                lower.extend(boxes_[ids_[i]]);
                lower_areas_[i] = half_area(lower);
            }
            Box upper;
            for (std::size_t i = end - 1; i > begin; --i) {
                upper.extend(boxes_[ids_[i]]);
                const double triangles = lower_areas_[i - 1] * static_cast<double>(i - begin) +
                                         half_area(upper) * static_cast<double>(end - i);
                // Nothing can be parted in a box without area.
                const double tested =
                    area > 0 ? triangles / area : static_cast<double>(end - begin);
                const double cost = 2 * kBoxCost + tested * kTriangleCost;
                if (cost < best.cost) best = {axis, i - begin, cost};
            }
        }
        return best;
    }

    std::uint32_t add_triangles(std::size_t begin, std::size_t end) {
        const auto first = static_cast<std::uint32_t>(tree_.triangles.size());
        for (std::size_t i = begin; i < end; ++i) {
            const uvec3 t = topology_.triangles[ids_[i]];
            tree_.triangles.push_back({positions_[t.x], positions_[t.y], positions_[t.z], ids_[i]});
        }
        return first;
    }

    const Topology& topology_;
    std::span<const vec3> positions_;
    std::vector<Box> boxes_;
    std::vector<std::uint32_t> ids_;
    std::vector<double> lower_areas_;
    Tree tree_;
};

}  // namespace

Tree build_sweep_tree(const Topology& topology, std::span<const vec3> positions) {
    return Builder(topology, positions).build();
}

void refit(Tree& tree, const Topology& topology, std::span<const vec3> positions) {
    using Range = tbb::blocked_range<std::size_t>;
    constexpr std::size_t kGrain = 1024;
    tbb::parallel_for(Range(0, tree.nodes.size(), kGrain), [&](const Range& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            Node& node = tree.nodes[n];
            if (node.count == 0) continue;
            Box box;
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                Triangle& triangle = tree.triangles[i];
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
        Node& node = tree.nodes[n];
        if (node.count > 0) continue;
        const Node& left = tree.nodes[node.first];
        const Node& right = tree.nodes[node.first + 1];
        node.lower = glm::min(left.lower, right.lower);
        node.upper = glm::max(left.upper, right.upper);
    }
}

}  // namespace mray::bench::paper_2007
