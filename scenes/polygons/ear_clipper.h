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
    void build(std::span<const PlanePoint> points, std::span<const std::uint32_t> members) {
        points_ = points;
        order_.assign(members.begin(), members.end());
        there_.assign(members.size(), 1);
        left_.resize(members.size());
        position_.resize(points.size());
        sort(0, order_.size(), true);
    }

    /// Removes a member that has not been removed yet.
    void remove(std::uint32_t member) {
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

    /// Whether accept(member) holds for a member in a closed box; stops at the first one. Subtracts
    /// the number of visits from `steps`; returns true when that reaches 0.
    template <class Accept>
    bool any_in_box(PlanePoint lower, PlanePoint upper, std::size_t& steps,
                    const Accept& accept) const {
        return search(0, order_.size(), true, lower, upper, steps, accept);
    }

private:
    void sort(std::size_t begin, std::size_t end, bool by_x) {
        if (begin == end) return;
        const std::size_t middle = begin + (end - begin) / 2;
        const auto at = [&](std::size_t i) {
            return order_.begin() + static_cast<std::ptrdiff_t>(i);
        };
        std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
            return by_x ? points_[a].x < points_[b].x : points_[a].y < points_[b].y;
        });
        left_[middle] = static_cast<std::uint32_t>(end - begin);
        position_[order_[middle]] = static_cast<std::uint32_t>(middle);
        sort(begin, middle, !by_x);
        sort(middle + 1, end, !by_x);
    }

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

/// Whether a point is inside or on the edge of a counter-clockwise triangle. One that coincides
/// with a corner is outside: polygons with a hole visit the ends of the bridge to it twice.
inline bool in_triangle(PlanePoint p, PlanePoint a, PlanePoint b, PlanePoint c) {
    const auto same = [p](PlanePoint other) { return p.x == other.x && p.y == other.y; };
    return doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 && doubled_area(c, a, p) >= 0 &&
           !same(a) && !same(b) && !same(c);
}

/// Keeps its memory from one polygon to the next. Not thread-safe.
class EarClipper {
public:
    /// Appends n - 2 triangles of the indices of `points`, the n corners of a polygon in
    /// counter-clockwise order, n >= 3, all finite. If no ear is left because edges cross, the rest
    /// becomes a fan. Returns false and appends nothing if that takes more than max_steps.
    bool clip(std::span<const PlanePoint> points, std::size_t max_steps,
              std::vector<std::array<std::uint32_t, 3>>& triangles) {
        const auto count = static_cast<std::uint32_t>(points.size());
        const std::size_t appended_from = triangles.size();
        points_ = points;
        left_ = count;
        steps_left_ = max_steps;
        previous_.resize(count);
        next_.resize(count);
        reflex_.resize(count);
        place_.resize(count);
        gone_.assign(count, 0);
        for (std::uint32_t i = 0; i < count; ++i) {
            previous_[i] = i == 0 ? count - 1 : i - 1;
            next_[i] = i + 1 == count ? 0 : i + 1;
        }
        queue_.clear();
        for (std::uint32_t i = 0; i < count; ++i) {
            reflex_[i] = turn(i) < 0;
            if (reflex_[i]) queue_.push_back(i);
        }
        reflex_tree_.build(points, queue_);

        // Cutting an ear without area leaves a corner in the middle of an edge, so such ears are
        // cut only if there is no other; that may expose ears with area.
        for (std::uint32_t before = count + 1; left_ > 3 && left_ < before;) {
            before = left_;
            if (!clip_ears(true, triangles) || !clip_ears(false, triangles)) {
                triangles.resize(appended_from);
                return false;
            }
        }
        std::uint32_t apex = 0;
        while (gone_[apex]) ++apex;
        for (std::uint32_t i = next_[apex]; next_[i] != apex; i = next_[i]) {
            triangles.push_back({apex, i, next_[i]});
        }
        return true;
    }

private:
    /// Twice the area of the triangle of a corner and its neighbours; negative where the polygon
    /// turns right.
    double turn(std::uint32_t corner) const {
        return doubled_area(points_[previous_[corner]], points_[corner], points_[next_[corner]]);
    }
    /// Whether a reflex corner lies in the triangle of this corner and its neighbours. Testing
    /// the reflex corners suffices: if any corner lies inside, a reflex one does.
    bool blocked(std::uint32_t corner) {
        const PlanePoint a = points_[previous_[corner]];
        const PlanePoint b = points_[corner];
        const PlanePoint c = points_[next_[corner]];
        const PlanePoint lower = {std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})};
        const PlanePoint upper = {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})};
        return reflex_tree_.any_in_box(lower, upper, steps_left_, [&](std::uint32_t other) {
            return in_triangle(points_[other], a, b, c);
        });
    }
    /// Cuts ears until no corner is left to try. Cutting one changes its neighbours only, so only
    /// they are tried again. Returns false if the steps are used up.
    bool clip_ears(bool with_area, std::vector<std::array<std::uint32_t, 3>>& triangles) {
        queue_.clear();
        for (std::uint32_t i = 0; i < points_.size(); ++i) {
            if (!gone_[i]) enqueue(i);
        }
        for (std::size_t head = 0; head < queue_.size() && left_ > 3; ++head) {
            const std::uint32_t corner = queue_[head];
            if (gone_[corner] || place_[corner] != head) continue;
            if (steps_left_ == 0) return false;
            --steps_left_;
            const double area = turn(corner);
            if (with_area ? !(area > 0) || blocked(corner) : area != 0) continue;
            triangles.push_back({previous_[corner], corner, next_[corner]});
            remove(corner);
        }
        return steps_left_ > 0;
    }
    /// A corner that is queued already moves to the end: cutting neighbours one after the other
    /// would make a fan, whose long triangles meet many reflex corners.
    void enqueue(std::uint32_t corner) {
        place_[corner] = queue_.size();
        queue_.push_back(corner);
    }
    void remove(std::uint32_t corner) {
        const std::uint32_t before = previous_[corner];
        const std::uint32_t after = next_[corner];
        next_[before] = after;
        previous_[after] = before;
        set_not_reflex(corner);
        gone_[corner] = 1;
        --left_;
        for (const std::uint32_t neighbour : {before, after}) {
            // A reflex corner can become convex, never the other way round.
            if (!(turn(neighbour) < 0)) set_not_reflex(neighbour);
            enqueue(neighbour);
        }
    }
    void set_not_reflex(std::uint32_t corner) {
        if (!reflex_[corner]) return;
        reflex_[corner] = 0;
        reflex_tree_.remove(corner);
    }

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
