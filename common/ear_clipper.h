// Ear clipping of one polygon in the plane.
//
// Based on: G. H. Meisters. Polygons have ears. 1975; D. Eberly. Triangulation by ear clipping.
// 2002. Changed: blocking vertices are found in a uniform grid, ears are taken first come first
// served, and the steps are bounded.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace morphray {

struct PlanePoint {
    double x = 0;
    double y = 0;
};

/// Twice the signed area of a triangle, positive if it is counter-clockwise.
inline double doubled_area(PlanePoint a, PlanePoint b, PlanePoint c) {
    return (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x);
}

/// Keeps its memory from one polygon to the next. Not thread-safe.
class EarClipper {
public:
    /// Appends n - 2 triangles of the indices of `points`, the n corners of a polygon in
    /// counter-clockwise order, n >= 3, all finite. Where no ear is left because edges cross, the
    /// rest becomes a fan. False, with nothing appended, when it would take more than max_steps.
    bool clip(std::span<const PlanePoint> points, std::size_t max_steps,
              std::vector<std::array<std::uint32_t, 3>>& triangles);

private:
    double turn(std::uint32_t corner) const;
    bool is_reflex(std::uint32_t corner) const { return turn(corner) < 0; }
    void place_reflex_corners();
    std::uint32_t cell_x(double x) const;
    std::uint32_t cell_y(double y) const;
    bool blocked(std::uint32_t corner);
    bool clip_ears(bool with_area, std::vector<std::array<std::uint32_t, 3>>& triangles);
    void remove(std::uint32_t corner);

    std::span<const PlanePoint> points_;
    std::vector<std::uint32_t> previous_;
    std::vector<std::uint32_t> next_;
    std::vector<char> reflex_;
    std::vector<char> queued_;
    std::vector<char> gone_;
    std::vector<std::uint32_t> queue_;
    std::uint32_t left_ = 0;
    std::size_t steps_left_ = 0;

    // The reflex corners by cell; cell c's are cell_corners_[cell_begin_[c] .. cell_end_[c]).
    std::uint32_t cells_ = 1;  // a side
    PlanePoint lower_;
    double cells_per_x_ = 0;
    double cells_per_y_ = 0;
    std::vector<std::uint32_t> cell_begin_;
    std::vector<std::uint32_t> cell_end_;
    std::vector<std::uint32_t> cell_corners_;
};

}  // namespace morphray
