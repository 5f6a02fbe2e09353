#include "scenes/polygons/ear_clipper.h"

#include <algorithm>

namespace mray {
namespace {

bool same(PlanePoint a, PlanePoint b) { return a.x == b.x && a.y == b.y; }

// Inside or on the edge of a counter-clockwise triangle. A point that coincides with a corner is
// outside: polygons with a hole visit the ends of the bridge to it twice.
bool in_triangle(PlanePoint p, PlanePoint a, PlanePoint b, PlanePoint c) {
    return doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 && doubled_area(c, a, p) >= 0 &&
           !same(p, a) && !same(p, b) && !same(p, c);
}

}  // namespace

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

// Twice the area of the triangle of a corner and its neighbours; negative where the polygon turns
// right.
double EarClipper::turn(std::uint32_t corner) const {
    return doubled_area(points_[previous_[corner]], points_[corner], points_[next_[corner]]);
}

// Whether a reflex corner lies in the triangle of this corner and its neighbours. Testing
// the reflex corners suffices: if any corner lies inside, a reflex one does.
bool EarClipper::blocked(std::uint32_t corner) {
    const PlanePoint a = points_[previous_[corner]];
    const PlanePoint b = points_[corner];
    const PlanePoint c = points_[next_[corner]];
    const PlanePoint lower = {std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})};
    const PlanePoint upper = {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})};
    return reflex_tree_.any_in_box(lower, upper, steps_left_, [&](std::uint32_t other) {
        return in_triangle(points_[other], a, b, c);
    });
}

void EarClipper::set_not_reflex(std::uint32_t corner) {
    if (!reflex_[corner]) return;
    reflex_[corner] = 0;
    reflex_tree_.remove(corner);
}

// A corner that is queued already moves to the end: cutting neighbours one after the other would
// make a fan, whose long triangles meet many reflex corners.
void EarClipper::enqueue(std::uint32_t corner) {
    place_[corner] = queue_.size();
    queue_.push_back(corner);
}

void EarClipper::remove(std::uint32_t corner) {
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

// Cuts ears until no corner is left to try. Cutting one changes its neighbours only, so only they
// are tried again. Returns false if the steps are used up.
bool EarClipper::clip_ears(bool with_area, std::vector<std::array<std::uint32_t, 3>>& triangles) {
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

bool EarClipper::clip(std::span<const PlanePoint> points, std::size_t max_steps,
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

    // Cutting an ear without area leaves a corner in the middle of an edge, so such ears are cut
    // only if there is no other; that may expose ears with area.
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

}  // namespace mray
