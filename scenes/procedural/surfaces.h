// Surfaces over regular grids: the sheets, spheres and tori that the built-in scenes are made of.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <glm/vec3.hpp>

#include "common/scene/mesh.h"
#include "scenes/trig.h"

namespace mray {

/// Rows and columns of quads of two triangles each. The surfaces number their vertices row by row
/// and their triangles quad by quad, also row by row.
struct Grid {
    std::uint32_t rows = 1;
    std::uint32_t columns = 1;
};

/// The colour of the two triangles of a quad.
using GridColour = std::function<Albedo(std::uint32_t row, std::uint32_t column)>;

/// An open rows x columns sheet: (rows + 1) * (columns + 1) vertices.
class Sheet {
public:
    /// With about that many triangles, at least 2, and nearly square.
    explicit Sheet(std::uint64_t triangles);

    const Grid& grid() const { return grid_; }
    std::uint32_t triangle_count() const { return 2 * grid_.rows * grid_.columns; }
    std::uint32_t vertex_count() const { return (grid_.rows + 1) * (grid_.columns + 1); }
    /// Adds vertices and triangles; counter-clockwise seen from +y when rows run along +z and
    /// columns along +x.
    void append_to(Topology& topology, const GridColour& colour) const;

private:
    Grid grid_;
};

/// A closed sphere: the poles (+y first, -y last) and rows - 1 rings of columns vertices.
class Sphere {
public:
    /// With about that many triangles, at least 6.
    explicit Sphere(std::uint64_t triangles);

    std::uint32_t triangle_count() const { return 2 * grid_.columns * (grid_.rows - 1); }
    std::uint32_t vertex_count() const { return grid_.columns * (grid_.rows - 1) + 2; }
    /// Adds vertices and triangles, counter-clockwise from outside.
    void append_to(Topology& topology, const GridColour& colour) const;
    const Grid& grid() const { return grid_; }
    /// The unit vector to a vertex.
    glm::dvec3 direction(std::uint32_t vertex) const;

private:
    Grid grid_;
    std::vector<CosSin> down_;
    std::vector<CosSin> around_;
};

/// A closed torus: rows go the long way round, columns around the tube.
class Torus {
public:
    /// With about that many triangles, at least 18, and `elongation` times as many rows as columns.
    Torus(std::uint64_t triangles, double elongation);

    const Grid& grid() const { return grid_; }
    std::uint32_t triangle_count() const { return 2 * grid_.rows * grid_.columns; }
    std::uint32_t vertex_count() const { return grid_.rows * grid_.columns; }
    /// The vertices of a triangle; counter-clockwise from outside when rows turn from +x to +y and
    /// columns from the outer equator to +z.
    uvec3 triangle(std::uint32_t index) const;

private:
    Grid grid_;
};

}  // namespace mray
