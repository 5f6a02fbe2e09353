#include "library/embree/scene/box_tree.h"

#include <algorithm>
#include <utility>

namespace mray::embree {

BoxTree::BoxTree(std::vector<PrimBox> boxes) : boxes_(std::move(boxes)), bounds_(boxes_.size()) {
    build(0, boxes_.size());
}

void BoxTree::build(std::size_t first, std::size_t last) {
    if (last - first <= kLeaf) return;
    Bounds around;
    for (std::size_t i = first; i < last; ++i) around.add(boxes_[i]);
    std::size_t longest = 0;
    for (std::size_t axis = 1; axis < 3; ++axis) {
        if (around.upper[axis] - around.lower[axis] > around.upper[longest] - around.lower[longest])
            longest = axis;
    }
    const std::size_t middle = first + (last - first) / 2;
    bounds_[middle] = around;
    const auto at = [&](std::size_t i) { return boxes_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(last), [&](const PrimBox& a, const PrimBox& b) {
        return a.lower[longest] + a.upper[longest] < b.lower[longest] + b.upper[longest];
    });
    build(first, middle);
    build(middle, last);
}

}  // namespace mray::embree
