#include "common/bvh/builder/collapse.h"

#include <tbb/parallel_invoke.h>

#include <cstring>

namespace mray {
namespace {

// g++ does not turn the loops below into vectors by itself.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
constexpr std::uint32_t kFours = kWidth / 4;

}  // namespace

Collapse::Collapse(BinaryTree& tree) : nodes_(tree.nodes) {
    if (nodes_.empty()) return;
    const std::size_t room = (nodes_.size() * sizeof(Costs) + sizeof(Leaf) - 1) / sizeof(Leaf);
    if (tree.spare.size() < room) tree.spare = AlignedVector<Leaf>(room);
    costs_ = new (tree.spare.data()) Costs[nodes_.size()];
    find_costs(0);
}

void Collapse::find_costs(std::uint32_t node) {
    Costs& own = costs_[node];
    if (nodes_[node].is_leaf()) {
        own.left_slots.fill(0);
        own.cost.fill(0);
        return;
    }
    const std::uint32_t left_child = nodes_[node].children;
    const std::uint32_t right_child = left_child + 1;
    // Larger subtrees get tasks of their own.
    constexpr std::uint32_t kSubtreeTask = 4096;
    if (nodes_[node].size() >= kSubtreeTask) {
        tbb::parallel_invoke([=, this] { find_costs(left_child); },
                             [=, this] { find_costs(right_child); });
    } else {
        find_costs(left_child);
        find_costs(right_child);
    }
    if (nodes_[left_child].is_leaf() && nodes_[right_child].is_leaf()) {
        // In two slots of the parent the leaves need no wide node, in one slot they need this one.
        own.cost.fill(0);
        own.left_slots.fill(1);
        own.left_slots[0] = 0;
        own.cost[0] = static_cast<float>(half_area(nodes_[node].box));
        return;
    }
    // own[i] = min over k of left[k - 1] + right[i - k], for all i at once: right[i - k] is
    // infinite for k > i. More slots than a subtree has leaves make it no cheaper.
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const std::array<float, kWidth>& left = costs_[left_child].cost;
    std::array<float, 2 * kWidth> right;
    std::fill_n(right.begin(), kWidth, kInfinity);
    std::copy_n(costs_[right_child].cost.begin(), kWidth, right.begin() + kWidth);
    std::array<Float4, kFours> best;
    std::array<Int4, kFours> best_left;
    best.fill(Float4{} + kInfinity);
    best_left.fill(Int4{});
    const std::uint32_t most_leaves = 1u << std::min(nodes_[left_child].height, 4u);
    for (std::uint32_t k = 1; k <= std::min(most_leaves, kWidth - 1); ++k) {
        const float* const shifted = right.data() + kWidth - k;
        for (std::uint32_t v = 0; v < kFours; ++v) {
            Float4 cost;
            std::memcpy(&cost, shifted + 4 * v, sizeof cost);
            cost += left[k - 1];
            const Int4 better = cost < best[v];
            best[v] = better ? cost : best[v];
            best_left[v] = better ? Int4{} + static_cast<std::int32_t>(k) : best_left[v];
        }
    }
    const float alone = best[kFours - 1][3] + static_cast<float>(half_area(nodes_[node].box));
    for (std::uint32_t v = 0; v < kFours; ++v) {
        best_left[v] &= best[v] <= alone;
        best[v] = best[v] <= alone ? best[v] : Float4{} + alone;
        for (std::uint32_t i = 0; i < 4; ++i)
            own.left_slots[4 * v + i] = static_cast<std::uint8_t>(best_left[v][i]);
    }
    std::memcpy(own.cost.data(), best.data(), sizeof own.cost);
}

WideChildren Collapse::children(std::uint32_t node, std::uint32_t depth) const {
    WideChildren result;
    const std::uint32_t left = nodes_[node].children;
    const std::uint32_t left_slots = costs_[node].left_slots[kWidth - 1];
    add_optimal(left, left_slots == 0 ? 1 : left_slots, result);
    add_optimal(left + 1, left_slots == 0 ? kWidth - 1 : kWidth - left_slots, result);
    const std::uint32_t height_limit = 4 * (kMaxDepth - depth - 1);
    const auto fits = [&](std::uint32_t child) { return nodes_[child].height <= height_limit; };
    const std::span<const std::uint32_t> found = result.nodes();
    if (std::all_of(found.begin(), found.end(), fits)) return result;
    // Opening all that is too high makes at most 2^4 children: each is at most four levels down,
    // because the node itself is no higher than height_limit + 4.
    result = {};
    add_levels(left, height_limit, result);
    add_levels(left + 1, height_limit, result);
    return result;
}

void Collapse::add_optimal(std::uint32_t node, std::uint32_t slots, WideChildren& out) const {
    const std::uint32_t left_slots = costs_[node].left_slots[slots - 1];
    if (slots == 1 || left_slots == 0) {
        out.add(node);
        return;
    }
    add_optimal(nodes_[node].children, left_slots, out);
    add_optimal(nodes_[node].children + 1, slots - left_slots, out);
}

void Collapse::add_levels(std::uint32_t node, std::uint32_t height_limit, WideChildren& out) const {
    if (nodes_[node].height <= height_limit) {
        out.add(node);
        return;
    }
    add_levels(nodes_[node].children, height_limit, out);
    add_levels(nodes_[node].children + 1, height_limit, out);
}

}  // namespace mray
