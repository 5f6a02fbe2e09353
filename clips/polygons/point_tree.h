// A k-d tree over points in the plane that supports removal.
//
// Based on: J. L. Bentley. Multidimensional binary search trees used for associative searching.
// 1975. Changed: the tree is an order of the points (the middle of a range splits it), and parts
// without points left are skipped.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mray {

struct PlanePoint {
    double x = 0;
    double y = 0;
};

/// Keeps its memory from one set of points to the next. Not thread-safe.
class PointTree {
public:
    /// Builds the tree of the points with these indices. `points` must outlive the use of the tree.
    void build(std::span<const PlanePoint> points, std::span<const std::uint32_t> members);

    /// Removes a member that has not been removed yet.
    void remove(std::uint32_t member);

    /// Whether accept(member) holds for a member in a closed box; stops at the first one. Subtracts
    /// the number of visits from `steps`; returns true when that reaches 0.
    template <class Accept>
    bool any_in_box(PlanePoint lower, PlanePoint upper, std::size_t& steps,
                    const Accept& accept) const {
        return search(0, order_.size(), true, lower, upper, steps, accept);
    }

private:
    void sort(std::size_t begin, std::size_t end, bool by_x);

    template <class Accept>
    bool search(std::size_t begin, std::size_t end, bool by_x, PlanePoint lower, PlanePoint upper,
                std::size_t& steps, const Accept& accept) const {
        if (begin == end) return false;
        const std::size_t middle = begin + (end - begin) / 2;
        if (left_[middle] == 0) return false;
        if (steps == 0) return true;
        --steps;
        const PlanePoint p = points_[order_[middle]];
        const double at = by_x ? p.x : p.y;
        if (there_[middle] && p.x >= lower.x && p.x <= upper.x && p.y >= lower.y &&
            p.y <= upper.y && accept(order_[middle])) {
            return true;
        }
        return ((by_x ? lower.x : lower.y) <= at &&
                search(begin, middle, !by_x, lower, upper, steps, accept)) ||
               ((by_x ? upper.x : upper.y) >= at &&
                search(middle + 1, end, !by_x, lower, upper, steps, accept));
    }

    std::span<const PlanePoint> points_;
    std::vector<std::uint32_t> order_;
    /// By the middle of a range: whether that point is present, and how many of the range are.
    std::vector<char> there_;
    std::vector<std::uint32_t> left_;
    /// By index into points_: where in order_.
    std::vector<std::uint32_t> position_;
};

}  // namespace mray
