#include "common/ear_clipper.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace morphray {
namespace {

constexpr std::uint32_t kMaxCellsPerSide = 1024;

bool same(PlanePoint a, PlanePoint b) { return a.x == b.x && a.y == b.y; }

// Inside or on the edge of a counter-clockwise triangle. A point that coincides with a corner is
// outside: polygons with a hole visit the ends of the bridge to it twice.
bool in_triangle(PlanePoint p, PlanePoint a, PlanePoint b, PlanePoint c) {
    return doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 && doubled_area(c, a, p) >= 0 &&
           !same(p, a) && !same(p, b) && !same(p, c);
}

}  // namespace

// Of a corner and its neighbours; negative where the polygon turns right.
double EarClipper::turn(std::uint32_t corner) const {
    return doubled_area(points_[previous_[corner]], points_[corner], points_[next_[corner]]);
}

std::uint32_t EarClipper::cell_x(double x) const {
    return std::min(cells_ - 1, static_cast<std::uint32_t>((x - lower_.x) * cells_per_x_));
}

std::uint32_t EarClipper::cell_y(double y) const {
    return std::min(cells_ - 1, static_cast<std::uint32_t>((y - lower_.y) * cells_per_y_));
}

void EarClipper::place_reflex_corners() {
    lower_ = points_[0];
    PlanePoint upper = points_[0];
    std::size_t reflex_count = 0;
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
        const PlanePoint p = points_[i];
        lower_ = {std::min(lower_.x, p.x), std::min(lower_.y, p.y)};
        upper = {std::max(upper.x, p.x), std::max(upper.y, p.y)};
        reflex_count += reflex_[i] != 0;
    }
    // About one reflex corner a cell.
    cells_ = std::clamp(static_cast<std::uint32_t>(std::sqrt(static_cast<double>(reflex_count))),
                        1u, kMaxCellsPerSide);
    cells_per_x_ = upper.x > lower_.x ? cells_ / (upper.x - lower_.x) : 0;
    cells_per_y_ = upper.y > lower_.y ? cells_ / (upper.y - lower_.y) : 0;
    // Of extents so small that the quotient overflows.
    if (!std::isfinite(cells_per_x_)) cells_per_x_ = 0;
    if (!std::isfinite(cells_per_y_)) cells_per_y_ = 0;

    // Counting sort by cell.
    const auto cell_of = [&](std::uint32_t corner) {
        return cell_y(points_[corner].y) * cells_ + cell_x(points_[corner].x);
    };
    cell_end_.assign(std::size_t{cells_} * cells_, 0);
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
        if (reflex_[i]) ++cell_end_[cell_of(i)];
    }
    cell_begin_.resize(cell_end_.size());
    std::uint32_t begin = 0;
    for (std::size_t cell = 0; cell < cell_end_.size(); ++cell) {
        cell_begin_[cell] = begin;
        begin += std::exchange(cell_end_[cell], begin);
    }
    cell_corners_.resize(begin);
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
        if (reflex_[i]) cell_corners_[cell_end_[cell_of(i)]++] = i;
    }
}

// Whether a reflex corner lies in the triangle of this corner and its neighbours. Of all corners
// only the reflex ones need a look: if any lies inside, a reflex one does.
bool EarClipper::blocked(std::uint32_t corner) {
    const std::uint32_t before = previous_[corner];
    const std::uint32_t after = next_[corner];
    const PlanePoint a = points_[before];
    const PlanePoint b = points_[corner];
    const PlanePoint c = points_[after];
    const std::uint32_t x_end = cell_x(std::max({a.x, b.x, c.x}));
    const std::uint32_t y_end = cell_y(std::max({a.y, b.y, c.y}));
    const std::uint32_t x_begin = cell_x(std::min({a.x, b.x, c.x}));
    for (std::uint32_t y = cell_y(std::min({a.y, b.y, c.y})); y <= y_end; ++y) {
        for (std::uint32_t x = x_begin; x <= x_end; ++x) {
            const std::size_t cell = std::size_t{y} * cells_ + x;
            const std::size_t cost = 1 + cell_end_[cell] - cell_begin_[cell];
            if (cost > steps_left_) {
                steps_left_ = 0;
                return true;
            }
            steps_left_ -= cost;
            for (std::uint32_t i = cell_begin_[cell]; i < cell_end_[cell]; ++i) {
                const std::uint32_t other = cell_corners_[i];
                if (!reflex_[other]) {
                    cell_corners_[i--] = cell_corners_[--cell_end_[cell]];
                } else if (other != before && other != after &&
                           in_triangle(points_[other], a, b, c)) {
                    return true;
                }
            }
        }
    }
    return false;
}

void EarClipper::remove(std::uint32_t corner) {
    const std::uint32_t before = previous_[corner];
    const std::uint32_t after = next_[corner];
    next_[before] = after;
    previous_[after] = before;
    reflex_[corner] = 0;
    gone_[corner] = 1;
    --left_;
    for (const std::uint32_t neighbour : {before, after}) {
        // A reflex corner can become convex, never the other way round.
        if (reflex_[neighbour] && !is_reflex(neighbour)) reflex_[neighbour] = 0;
        if (!queued_[neighbour]) {
            queued_[neighbour] = 1;
            queue_.push_back(neighbour);
        }
    }
}

// Cuts ears until none is left to try; cutting one changes its neighbours only, so they alone are
// tried again. With area first, because an ear without area would leave the edge that it lies on
// with a corner in its middle. False when the steps are used up.
bool EarClipper::clip_ears(bool with_area, std::vector<std::array<std::uint32_t, 3>>& triangles) {
    queue_.clear();
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
        queued_[i] = !gone_[i];
        if (!gone_[i]) queue_.push_back(i);
    }
    for (std::size_t head = 0; head < queue_.size() && left_ > 3; ++head) {
        const std::uint32_t corner = queue_[head];
        if (gone_[corner]) continue;
        queued_[corner] = 0;
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
    queued_.assign(count, 0);
    gone_.assign(count, 0);
    for (std::uint32_t i = 0; i < count; ++i) {
        previous_[i] = i == 0 ? count - 1 : i - 1;
        next_[i] = i + 1 == count ? 0 : i + 1;
    }
    for (std::uint32_t i = 0; i < count; ++i) reflex_[i] = is_reflex(i);
    place_reflex_corners();

    // Ears without area may make way for ones with.
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

}  // namespace morphray
