// Ear clipping of one polygon in the plane.
//
// Based on: G. H. Meisters. Polygons have ears. 1975; D. Eberly. Triangulation by ear clipping.
// 2002. Changed: blocking corners are found in a k-d tree, ears are cut in the order of a
// queue, those with area before those without, and the steps are bounded.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mray {

struct PlanePoint {
    double x = 0;
    double y = 0;
};

/// A k-d tree over points in the plane that supports removal.
///
/// Based on: J. L. Bentley. Multidimensional binary search trees used for associative searching.
/// 1975. Changed: the tree is an order of the points (the middle of a range splits it), and parts
/// without points left are skipped.
///
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

/// Twice the signed area of a triangle, positive if it is counter-clockwise.
inline double doubled_area(PlanePoint a, PlanePoint b, PlanePoint c) {
    return (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
}

/// Keeps its memory from one polygon to the next. Not thread-safe.
class EarClipper {
public:
    /// Appends n - 2 triangles of the indices of `points`, the n corners of a polygon in
    /// counter-clockwise order, n >= 3, all finite. If no ear is left because edges cross, the rest
    /// becomes a fan. Returns false and appends nothing if that takes more than max_steps.
    bool clip(std::span<const PlanePoint> points, std::size_t max_steps,
              std::vector<std::array<std::uint32_t, 3>>& triangles);

private:
    double turn(std::uint32_t corner) const;
    bool blocked(std::uint32_t corner);
    bool clip_ears(bool with_area, std::vector<std::array<std::uint32_t, 3>>& triangles);
    void enqueue(std::uint32_t corner);
    void remove(std::uint32_t corner);
    void set_not_reflex(std::uint32_t corner);

    std::span<const PlanePoint> points_;
    std::vector<std::uint32_t> previous_;
    std::vector<std::uint32_t> next_;
    std::vector<char> reflex_;
    std::vector<char> gone_;
    std::vector<std::uint32_t> queue_;
    /// By corner: its last place in queue_, which is the valid one.
    std::vector<std::size_t> place_;
    PointTree reflex_tree_;
    std::uint32_t left_ = 0;
    std::size_t steps_left_ = 0;
};

}  // namespace mray
