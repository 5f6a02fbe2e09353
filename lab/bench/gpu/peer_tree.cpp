#include "lab/bench/gpu/peer_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include <glm/common.hpp>

#include "lab/bench/gpu/peer_interface.h"

namespace mray::bench {
namespace {

constexpr int kBins = 16;
constexpr std::uint32_t kMostTriangles = 4;
/// The cost of a node, in tests of a triangle.
constexpr float kNodeCost = 1.5f;

struct Box {
    vec3 lower = vec3(std::numeric_limits<float>::max());
    vec3 upper = vec3(-std::numeric_limits<float>::max());

    void add(const Box& box) {
        lower = glm::min(lower, box.lower);
        upper = glm::max(upper, box.upper);
    }
    float area() const {
        if (lower.x > upper.x) return 0;
        const vec3 d = upper - lower;
        return d.x * d.y + d.y * d.z + d.z * d.x;
    }
};

struct Part {
    Box box;
    vec3 centre;
    std::uint32_t prim_id;
};

struct Split {
    float cost = std::numeric_limits<float>::max();
    int axis = 0;
    int bin = 0;
    Box left, right;
};

class Builder {
public:
    Builder(std::span<const uvec3> triangles, std::span<const vec3> positions)
        : triangles_(triangles), positions_(positions) {
        for (std::uint32_t i = 0; i < triangles.size(); ++i) {
            Part& part = parts_.emplace_back(Part{{}, {}, i});
            for (int k = 0; k < 3; ++k)
                part.box.add({positions[triangles[i][k]], positions[triangles[i][k]]});
            part.centre = 0.5f * (part.box.lower + part.box.upper);
        }
    }

    PeerTree build() {
        Box all;
        for (const Part& part : parts_) all.add(part.box);
        const int root = add_node();
        const Split split = best_split(0, parts_.size());
        divide(root, 0, parts_.size(), split, 1);
        return std::move(tree_);
    }

private:
    int add_node() {
        tree_.nodes.resize(tree_.nodes.size() + kPeerNodeVec4s);
        return static_cast<int>(tree_.nodes.size() / kPeerNodeVec4s) - 1;
    }

    static int bin_of(float centre, float lower, float scale) {
        return std::clamp(static_cast<int>((centre - lower) * scale), 0, kBins - 1);
    }

    static float scale_of(float lower, float upper) {
        return upper > lower ? kBins / (upper - lower) : 0;
    }

    Box centres(std::size_t begin, std::size_t end) const {
        Box box;
        for (std::size_t i = begin; i < end; ++i) box.add({parts_[i].centre, parts_[i].centre});
        return box;
    }

    Split best_split(std::size_t begin, std::size_t end) const {
        const Box extent = centres(begin, end);
        Split best;
        for (int axis = 0; axis < 3; ++axis) {
            const float scale = scale_of(extent.lower[axis], extent.upper[axis]);
            if (scale == 0) continue;
            std::array<Box, kBins> boxes = {};
            std::array<std::uint32_t, kBins> counts = {};
            for (std::size_t i = begin; i < end; ++i) {
                const int bin = bin_of(parts_[i].centre[axis], extent.lower[axis], scale);
                boxes[static_cast<std::size_t>(bin)].add(parts_[i].box);
                ++counts[static_cast<std::size_t>(bin)];
            }
            std::array<Box, kBins> rights = boxes;
            for (std::size_t b = kBins - 1; b-- > 0;) rights[b].add(rights[b + 1]);
            Box left;
            std::uint32_t count = 0;
            for (std::size_t b = 0; b + 1 < kBins; ++b) {
                left.add(boxes[b]);
                count += counts[b];
                const auto rest = static_cast<float>(end - begin - count);
                const float cost =
                    left.area() * static_cast<float>(count) + rights[b + 1].area() * rest;
                if (count == 0 || rest == 0 || cost >= best.cost) continue;
                best = {cost, axis, static_cast<int>(b), left, rights[b + 1]};
            }
        }
        return best;
    }

    /// Sets the children of `node` to the parts of a range, by a split that may have failed.
    void divide(int node, std::size_t begin, std::size_t end, Split split, int depth) {
        std::size_t middle = (begin + end) / 2;
        if (split.cost < std::numeric_limits<float>::max()) {
            const Box extent = centres(begin, end);
            const float scale = scale_of(extent.lower[split.axis], extent.upper[split.axis]);
            const auto place = std::partition(
                parts_.begin() + static_cast<std::ptrdiff_t>(begin),
                parts_.begin() + static_cast<std::ptrdiff_t>(end), [&](const Part& part) {
                    return bin_of(part.centre[split.axis], extent.lower[split.axis], scale) <=
                           split.bin;
                });
            middle = static_cast<std::size_t>(place - parts_.begin());
        } else {
            split.left = split.right = Box();
            for (std::size_t i = begin; i < end; ++i)
                (i < middle ? split.left : split.right).add(parts_[i].box);
        }
        const int children[] = {make_child(begin, middle, split.left, depth),
                                make_child(middle, end, split.right, depth)};
        const Box& a = split.left;
        const Box& b = split.right;
        vec4* const out = &tree_.nodes[static_cast<std::size_t>(node) * kPeerNodeVec4s];
        out[0] = {a.lower.x, a.upper.x, a.lower.y, a.upper.y};
        out[1] = {b.lower.x, b.upper.x, b.lower.y, b.upper.y};
        out[2] = {a.lower.z, a.upper.z, b.lower.z, b.upper.z};
        out[3] = {std::bit_cast<float>(children[0]), std::bit_cast<float>(children[1]), 0, 0};
    }

    int make_child(std::size_t begin, std::size_t end, const Box& box, int depth) {
        const std::size_t count = end - begin;
        if (count <= 1) return make_leaf(begin, end);
        const Split split = best_split(begin, end);
        const float split_cost = split.cost + kNodeCost * box.area();
        if (count <= kMostTriangles && box.area() * static_cast<float>(count) <= split_cost)
            return make_leaf(begin, end);
        const int node = add_node();
        // Deeper trees than stacks are halved by number.
        divide(node, begin, end, depth < 40 ? split : Split{}, depth + 1);
        return node;
    }

    int make_leaf(std::size_t begin, std::size_t end) {
        const auto first = static_cast<int>(tree_.triangles.size() / kPeerTriangleVec4s);
        for (std::size_t i = begin; i < end; ++i) {
            const uvec3& t = triangles_[parts_[i].prim_id];
            tree_.triangles.emplace_back(positions_[t.x], std::bit_cast<float>(parts_[i].prim_id));
            tree_.triangles.emplace_back(positions_[t.y], 0.0f);
            tree_.triangles.emplace_back(positions_[t.z], 0.0f);
        }
        return ~(8 * first + static_cast<int>(end - begin));
    }

    std::span<const uvec3> triangles_;
    std::span<const vec3> positions_;
    std::vector<Part> parts_;
    PeerTree tree_;
};

}  // namespace

std::uint32_t PeerTree::prim_id(std::size_t i) const {
    return std::bit_cast<std::uint32_t>(triangles[kPeerTriangleVec4s * i].w);
}

PeerTree build_peer_tree(std::span<const uvec3> triangles, std::span<const vec3> positions) {
    return Builder(triangles, positions).build();
}

}  // namespace mray::bench
