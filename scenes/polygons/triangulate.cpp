#include "scenes/polygons/triangulate.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace mray {
namespace {

struct PlanePoint {
    double x = 0;
    double y = 0;
};

/// Twice the signed area of a triangle, positive if it is counter-clockwise.
double doubled_area(PlanePoint a, PlanePoint b, PlanePoint c) {
    return (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
}

/// A point at a corner is outside: polygons with a hole visit the ends of the bridge to it twice.
bool in_triangle(PlanePoint p, PlanePoint a, PlanePoint b, PlanePoint c) {
    const auto same = [p](PlanePoint other) { return p.x == other.x && p.y == other.y; };
    return doubled_area(a, b, p) >= 0 && doubled_area(b, c, p) >= 0 && doubled_area(c, a, p) >= 0 &&
           !same(a) && !same(b) && !same(c);
}

/// Ear clipping, which keeps its memory from one polygon to the next.
///
/// Based on: G. H. Meisters. Polygons have ears. 1975; D. Eberly. Triangulation by ear clipping.
/// 2002. Changed: ears are cut in the order of a queue, those with area before those without.
class EarClipper {
public:
    /// Appends n - 2 triangles of the n >= 3 finite corners of a counter-clockwise polygon. If no
    /// ear is left because edges cross, the rest becomes a fan.
    void clip(std::span<const PlanePoint> points, std::vector<uvec3>& triangles) {
        const auto count = static_cast<std::uint32_t>(points.size());
        points_ = points;
        left_ = count;
        previous_.resize(count);
        next_.resize(count);
        place_.resize(count);
        gone_.assign(count, 0);
        for (std::uint32_t i = 0; i < count; ++i) {
            previous_[i] = i == 0 ? count - 1 : i - 1;
            next_[i] = i + 1 == count ? 0 : i + 1;
        }
        reflex_.clear();
        for (std::uint32_t i = 0; i < count; ++i)
            if (turn(i) < 0) reflex_.push_back(i);

        // An ear without area leaves a corner within an edge, but may expose ears with area.
        for (std::uint32_t before = count + 1; left_ > 3 && left_ < before;) {
            before = left_;
            clip_ears(true, triangles);
            clip_ears(false, triangles);
        }
        std::uint32_t apex = 0;
        while (gone_[apex]) ++apex;
        for (std::uint32_t i = next_[apex]; next_[i] != apex; i = next_[i]) {
            triangles.emplace_back(apex, i, next_[i]);
        }
    }

private:
    /// Twice the area of the triangle of a corner and its neighbours; negative for a right turn.
    double turn(std::uint32_t corner) const {
        return doubled_area(points_[previous_[corner]], points_[corner], points_[next_[corner]]);
    }
    /// Testing the reflex corners suffices: if any corner lies inside, a reflex one does.
    bool blocked(std::uint32_t corner) const {
        const PlanePoint a = points_[previous_[corner]];
        const PlanePoint b = points_[corner];
        const PlanePoint c = points_[next_[corner]];
        const PlanePoint lower = {std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y})};
        const PlanePoint upper = {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y})};
        return std::any_of(reflex_.begin(), reflex_.end(), [&](std::uint32_t other) {
            const PlanePoint p = points_[other];
            return p.x >= lower.x && p.x <= upper.x && p.y >= lower.y && p.y <= upper.y &&
                   in_triangle(p, a, b, c);
        });
    }
    /// Cutting an ear changes its neighbours only, so only they are tried again.
    void clip_ears(bool with_area, std::vector<uvec3>& triangles) {
        queue_.clear();
        for (std::uint32_t i = 0; i < points_.size(); ++i) {
            if (!gone_[i]) enqueue(i);
        }
        for (std::size_t head = 0; head < queue_.size() && left_ > 3; ++head) {
            const std::uint32_t corner = queue_[head];
            if (gone_[corner] || place_[corner] != head) continue;
            const double area = turn(corner);
            if (with_area ? !(area > 0) || blocked(corner) : area != 0) continue;
            triangles.emplace_back(previous_[corner], corner, next_[corner]);
            remove(corner);
        }
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
        const auto found = std::lower_bound(reflex_.begin(), reflex_.end(), corner);
        if (found != reflex_.end() && *found == corner) reflex_.erase(found);
    }

    std::span<const PlanePoint> points_;
    std::vector<std::uint32_t> previous_;
    std::vector<std::uint32_t> next_;
    /// The corners that are reflex, in increasing order.
    std::vector<std::uint32_t> reflex_;
    std::vector<char> gone_;
    std::vector<std::uint32_t> queue_;
    /// By corner: its last place in queue_, which is the valid one.
    std::vector<std::size_t> place_;
    std::uint32_t left_ = 0;
};

using Corners = std::span<const std::uint32_t>;

// Newell's (M. E. Newell et al. 1972), relative to the first corner for the sake of digits.
glm::dvec3 face_normal(Corners corners, std::span<const vec3> positions) {
    const glm::dvec3 origin(positions[corners[0]]);
    glm::dvec3 sum(0.0);
    glm::dvec3 last(0.0);
    for (const std::uint32_t corner : corners) {
        const glm::dvec3 p = glm::dvec3(positions[corner]) - origin;
        sum += glm::cross(last, p);
        last = p;
    }
    return sum;
}

// Projects along the axis in which the face is largest, which keeps coordinates exact, and makes it
// counter-clockwise. Returns false for no area or what is not finite.
bool project(Corners corners, std::span<const vec3> positions, std::vector<PlanePoint>& points) {
    const glm::dvec3 normal = face_normal(corners, positions);
    int dropped = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (std::abs(normal[axis]) > std::abs(normal[dropped])) dropped = axis;
    }
    if (normal[dropped] == 0) return false;
    int x = (dropped + 1) % 3;
    int y = (dropped + 2) % 3;
    if (normal[dropped] < 0) std::swap(x, y);
    points.clear();
    for (const std::uint32_t corner : corners) {
        const vec3 p = positions[corner];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return false;
        points.push_back({p[x], p[y]});
    }
    return true;
}

bool fan_covers(std::span<const PlanePoint> points) {
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
        if (!(doubled_area(points[0], points[i], points[i + 1]) > 0)) return false;
    }
    return true;
}

}  // namespace

std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               std::vector<uvec3>* corners_of_triangles) {
    std::vector<uvec3> triangles;
    triangles.reserve(faces.corners.size() - 2 * faces.corner_counts.size());
    EarClipper clipper;
    std::vector<PlanePoint> points;
    std::vector<uvec3> ears;
    std::uint32_t first = 0;
    for (std::size_t face = 0; face < faces.corner_counts.size(); ++face) {
        const std::uint32_t count = faces.corner_counts[face];
        const Corners corners(faces.corners.data() + first, count);
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            triangles.emplace_back(corners[a], corners[b], corners[c]);
            if (corners_of_triangles != nullptr)
                corners_of_triangles->emplace_back(first + a, first + b, first + c);
        };
        const bool is_fan =
            count == 3 || !project(corners, positions, points) || fan_covers(points);
        ears.clear();
        if (!is_fan) clipper.clip(points, ears);
        for (std::uint32_t i = 1; is_fan && i + 1 < count; ++i) add(0, i, i + 1);
        for (const uvec3& ear : ears) add(ear.x, ear.y, ear.z);
        first += count;
    }
    return triangles;
}

}  // namespace mray
