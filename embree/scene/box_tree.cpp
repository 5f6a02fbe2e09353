#include "embree/scene/box_tree.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace mray::embree {

float PrimBox::distance2(const std::array<float, 3>& point) const {
    float sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float beside = std::max({lower[axis] - point[axis], 0.0f, point[axis] - upper[axis]});
        sum += beside * beside;
    }
    return sum;
}

BoxTree::BoxTree(std::vector<PrimBox> boxes) : boxes_(std::move(boxes)), bounds_(boxes_.size()) {
    build(0, boxes_.size());
}

void BoxTree::build(std::size_t first, std::size_t last) {
    if (last - first <= kLeaf) return;
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    PrimBox around = {
        {kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}, 0, 0};
    for (std::size_t i = first; i < last; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            around.lower[axis] = std::min(around.lower[axis], boxes_[i].lower[axis]);
            around.upper[axis] = std::max(around.upper[axis], boxes_[i].upper[axis]);
        }
    }
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
