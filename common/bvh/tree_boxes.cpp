#include "common/bvh/tree_boxes.h"

namespace mray {

std::vector<Box> boxes_at_depth(const Bvh& bvh, std::uint32_t depth) {
    std::vector<Box> boxes;
    if (depth > bvh.depth()) return boxes;
    // The slots of a level hold the boxes of the next one.
    const std::uint32_t level = depth == 0 ? 0 : depth - 1;
    for (std::uint32_t i = bvh.level_begin[level]; i < bvh.level_begin[level + 1]; ++i) {
        const Node& node = bvh.nodes[i];
        for (std::uint32_t k = 0; k < kWidth; ++k) {
            const Box box{{node.lower_x[k], node.lower_y[k], node.lower_z[k]},
                          {node.upper_x[k], node.upper_y[k], node.upper_z[k]}};
            if (!box.empty()) boxes.push_back(box);
        }
    }
    if (depth > 0 || boxes.empty()) return boxes;
    Box all;
    for (const Box& box : boxes) all.extend(box);
    return {all};
}

}  // namespace mray
