#include "common/collapse.h"

#include <algorithm>

namespace morphray {

Collapse::Collapse(const std::vector<BinaryNode>& nodes) : nodes_(nodes), costs_(nodes.size()) {
    // Preorder: children come after their parent.
    for (std::size_t i = nodes.size(); i-- > 0;) {
        Costs& own = costs_[i];
        own.left_slots.fill(0);
        own.cost.fill(0);
        if (nodes[i].is_leaf()) continue;
        const Costs& left = costs_[i + 1];
        const Costs& right = costs_[nodes[i].right];
        for (std::size_t slots = 2; slots <= kWidth; ++slots) {
            float best = left.cost[0] + right.cost[slots - 2];
            std::uint8_t best_left = 1;
            for (std::size_t k = 2; k < slots; ++k) {
                const float cost = left.cost[k - 1] + right.cost[slots - k - 1];
                if (cost < best) {
                    best = cost;
                    best_left = static_cast<std::uint8_t>(k);
                }
            }
            own.cost[slots - 1] = best;
            own.left_slots[slots - 1] = best_left;
        }
        const float alone = own.cost[kWidth - 1] + static_cast<float>(half_area(nodes[i].box));
        own.cost[0] = alone;
        for (std::size_t slots = 2; slots <= kWidth; ++slots) {
            if (own.cost[slots - 1] <= alone) continue;
            own.cost[slots - 1] = alone;
            own.left_slots[slots - 1] = 0;
        }
    }
}

std::vector<std::uint32_t> Collapse::children(std::uint32_t node, std::uint32_t levels_left) const {
    std::vector<std::uint32_t> result;
    const std::uint32_t left_slots = costs_[node].left_slots[kWidth - 1];
    add_optimal(node + 1, left_slots == 0 ? 1 : left_slots, result);
    add_optimal(nodes_[node].right, left_slots == 0 ? kWidth - 1 : kWidth - left_slots, result);
    const std::uint32_t height_limit = 4 * (levels_left - 1);
    const bool fits = std::all_of(result.begin(), result.end(), [&](std::uint32_t child) {
        return nodes_[child].height <= height_limit;
    });
    if (fits) return result;
    // Opening all that is too high makes at most 2^4 children: each is at most four levels down,
    // because the node itself is no higher than height_limit + 4.
    result.clear();
    add_levels(node + 1, height_limit, result);
    add_levels(nodes_[node].right, height_limit, result);
    return result;
}

void Collapse::add_optimal(std::uint32_t node, std::uint32_t slots,
                           std::vector<std::uint32_t>& out) const {
    const std::uint32_t left_slots = costs_[node].left_slots[slots - 1];
    if (slots == 1 || left_slots == 0) {
        out.push_back(node);
        return;
    }
    add_optimal(node + 1, left_slots, out);
    add_optimal(nodes_[node].right, slots - left_slots, out);
}

void Collapse::add_levels(std::uint32_t node, std::uint32_t height_limit,
                          std::vector<std::uint32_t>& out) const {
    if (nodes_[node].height <= height_limit) {
        out.push_back(node);
        return;
    }
    add_levels(node + 1, height_limit, out);
    add_levels(nodes_[node].right, height_limit, out);
}

}  // namespace morphray
