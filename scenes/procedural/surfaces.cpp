#include "scenes/procedural/surfaces.h"

#include <algorithm>

namespace mray {

void append_triangle(Topology& topology, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                     Albedo albedo) {
    topology.triangles.emplace_back(a, b, c);
    topology.albedo.push_back(albedo);
}

Grid grid_of(double quads, double elongation, std::uint32_t fewest_rows,
             std::uint32_t fewest_columns) {
    const double rows = std::max(std::round(std::sqrt(quads * elongation)), double(fewest_rows));
    const double columns = std::max(std::round(quads / rows), double(fewest_columns));
    return {static_cast<std::uint32_t>(rows), static_cast<std::uint32_t>(columns)};
}

Sheet::Sheet(std::uint64_t triangles)
    : grid_(grid_of(static_cast<double>(triangles) / 2, 1, 1, 1)) {}

void Sheet::append_to(Topology& topology, const GridColour& colour) const {
    const std::uint32_t stride = grid_.columns + 1;
    for (std::uint32_t row = 0; row < grid_.rows; ++row) {
        for (std::uint32_t column = 0; column < grid_.columns; ++column) {
            const std::uint32_t a = topology.vertex_count + row * stride + column;
            const std::uint32_t c = a + stride;
            const Albedo albedo = colour(row, column);
            append_triangle(topology, a, c, a + 1, albedo);
            append_triangle(topology, a + 1, c, c + 1, albedo);
        }
    }
    topology.vertex_count += vertex_count();
}

Sphere::Sphere(std::uint64_t triangles) {
    // The two rows at the poles have half as many triangles. Quads at the equator are square.
    const Grid rings = grid_of(static_cast<double>(triangles) / 2, 0.5, 1, 3);
    grid_ = {rings.rows + 1, rings.columns};
    for (std::uint32_t row = 0; row <= grid_.rows; ++row)
        down_.push_back(circle_point(0.5 * row / grid_.rows));
    for (std::uint32_t column = 0; column < grid_.columns; ++column)
        around_.push_back(circle_point(static_cast<double>(column) / grid_.columns));
}

void Sphere::append_to(Topology& topology, const GridColour& colour) const {
    const auto at = [&](std::uint32_t row, std::uint32_t column) {
        return topology.vertex_count + vertex(row, column);
    };
    for (std::uint32_t row = 0; row < grid_.rows; ++row) {
        for (std::uint32_t column = 0; column < grid_.columns; ++column) {
            const Albedo albedo = colour(row, column);
            // At the poles one of the two has no area.
            if (row + 1 < grid_.rows)
                append_triangle(topology, at(row, column), at(row + 1, column + 1),
                                at(row + 1, column), albedo);
            if (row > 0)
                append_triangle(topology, at(row, column), at(row, column + 1),
                                at(row + 1, column + 1), albedo);
        }
    }
    topology.vertex_count += vertex_count();
}

std::uint32_t Sphere::vertex(std::uint32_t row, std::uint32_t column) const {
    if (row == 0) return 0;
    if (row == grid_.rows) return vertex_count() - 1;
    return 1 + (row - 1) * grid_.columns + column % grid_.columns;
}

glm::dvec3 Sphere::direction(std::uint32_t vertex) const {
    if (vertex == 0) return {0, 1, 0};
    if (vertex + 1 == vertex_count()) return {0, -1, 0};
    const CosSin down = down_[(vertex - 1) / grid_.columns + 1];
    const CosSin around = around_[(vertex - 1) % grid_.columns];
    return {down.sin * around.cos, down.cos, down.sin * around.sin};
}

}  // namespace mray
