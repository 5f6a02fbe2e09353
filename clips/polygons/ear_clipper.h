// Ear clipping of one polygon in the plane.
//
// Based on: G. H. Meisters. Polygons have ears. 1975; D. Eberly. Triangulation by ear clipping.
// 2002. Changed: blocking corners are found in a k-d tree, ears are cut in the order of a
// queue, those with area before those without, and the steps are bounded.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "clips/polygons/point_tree.h"

namespace mray {

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
