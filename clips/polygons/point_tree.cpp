#include "clips/polygons/point_tree.h"

namespace mray {

void PointTree::sort(std::size_t begin, std::size_t end, bool by_x) {
    if (begin == end) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
        return by_x ? points_[a].x < points_[b].x : points_[a].y < points_[b].y;
    });
    left_[middle] = static_cast<std::uint32_t>(end - begin);
    position_[order_[middle]] = static_cast<std::uint32_t>(middle);
    sort(begin, middle, !by_x);
    sort(middle + 1, end, !by_x);
}

void PointTree::build(std::span<const PlanePoint> points, std::span<const std::uint32_t> members) {
    points_ = points;
    order_.assign(members.begin(), members.end());
    there_.assign(members.size(), 1);
    left_.resize(members.size());
    position_.resize(points.size());
    sort(0, order_.size(), true);
}

void PointTree::remove(std::uint32_t member) {
    const std::size_t position = position_[member];
    there_[position] = 0;
    std::size_t begin = 0;
    std::size_t end = order_.size();
    for (;;) {
        const std::size_t middle = begin + (end - begin) / 2;
        --left_[middle];
        if (middle == position) return;
        (position < middle ? end : begin) = position < middle ? middle : middle + 1;
    }
}

}  // namespace mray
