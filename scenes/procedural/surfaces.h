// What built-in scenes are made of: colours, turns, pseudorandom numbers, and surfaces over grids.
#pragma once

#include <vector>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scenes/animation.h"
#include "scenes/trig.h"

namespace mray {

/// Built-in scenes have the frames from 0 to this one.
inline constexpr double kLastFrame = 24;

struct DeformingMesh {
    Topology topology;
    /// Writes out[begin..end), a pure function of frame and vertex. Many threads call it at once.
    std::function<void(double frame, IndexRange range, std::span<vec3> out)> move;
    /// The result of Animation::inside_view().
    std::optional<InsideView> inside_view;
};

inline vec3 round_to_float(const glm::dvec3& p) {
    return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

/// The largest n with n^3 <= x, for x up to 2^60. std::cbrt rounds differently in different libms.
constexpr std::uint32_t cube_root(std::uint64_t x) {
    std::uint64_t root = 0;
    for (std::uint64_t bit = std::uint64_t{1} << 20; bit > 0; bit >>= 1) {
        const std::uint64_t next = root | bit;
        if (next * next * next <= x) root = next;
    }
    return static_cast<std::uint32_t>(root);
}

constexpr Albedo rgb(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
    return r | (g << 8) | (b << 16);
}

/// Distinct colours for parts, repeating.
constexpr Albedo palette(std::uint64_t i) {
    constexpr std::array<Albedo, 8> colours = {
        rgb(176, 42, 30),  rgb(28, 98, 150),  rgb(208, 140, 26), rgb(40, 120, 60),
        rgb(120, 60, 140), rgb(24, 136, 130), rgb(206, 92, 40),  rgb(170, 160, 130)};
    return colours[i % colours.size()];
}

/// p turned about the unit vector axis (Rodrigues' formula).
inline glm::dvec3 rotate(const glm::dvec3& p, const glm::dvec3& axis, CosSin turn) {
    return turn.cos * p + turn.sin * glm::cross(axis, p) +
           (1 - turn.cos) * glm::dot(axis, p) * axis;
}

/// Based on: Guy L. Steele Jr., Doug Lea, Christine H. Flood. Fast splittable pseudorandom number
/// generators. OOPSLA 2014: the finaliser of SplitMix64, here on a counter.
inline std::uint64_t hash_bits(std::uint64_t seed, std::uint64_t index) {
    std::uint64_t z = (seed << 40) + (index + 1) * 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/// The k-th draw for an index: uniform in [0, 1).
inline double uniform(std::uint64_t seed, std::uint64_t index, std::uint64_t k = 0) {
    return static_cast<double>(hash_bits(seed + k, index) >> 11) * 0x1p-53;
}

/// A direction, uniform on the unit sphere, from draws k and k + 1.
inline glm::dvec3 uniform_direction(std::uint64_t seed, std::uint64_t index, std::uint64_t k = 0) {
    const double y = 2 * uniform(seed, index, k) - 1;
    const double around = uniform(seed, index, k + 1);
    const double ring = std::sqrt(1 - y * y);
    return {ring * cos_turns(around), y, ring * sin_turns(around)};
}

void append_triangle(Topology& topology, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                     Albedo albedo);

/// Quads of two triangles each, row by row, as are the vertices of surfaces.
struct Grid {
    std::uint32_t rows = 1;
    std::uint32_t columns = 1;
};

/// About `quads` quads in rows and columns with rows = elongation * columns.
Grid grid_of(double quads, double elongation, std::uint32_t fewest_rows,
             std::uint32_t fewest_columns);

using GridColour = std::function<Albedo(std::uint32_t row, std::uint32_t column)>;

/// An open rows x columns sheet: (rows + 1) * (columns + 1) vertices.
class Sheet {
public:
    /// With about that many triangles, at least 2, and nearly square.
    explicit Sheet(std::uint64_t triangles);

    const Grid& grid() const { return grid_; }
    std::uint32_t triangle_count() const { return 2 * grid_.rows * grid_.columns; }
    std::uint32_t vertex_count() const { return (grid_.rows + 1) * (grid_.columns + 1); }
    /// Counter-clockwise seen from +y when rows run along +z and columns along +x.
    void append_to(Topology& topology, const GridColour& colour) const;
    /// The place of a vertex along x and z, from -1 to 1.
    glm::dvec2 at(std::uint32_t vertex) const {
        const std::uint32_t stride = grid_.columns + 1;
        return {2.0 * (vertex % stride) / grid_.columns - 1,
                2.0 * (vertex / stride) / grid_.rows - 1};
    }

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
    /// `row` from pole to pole; `column` goes on around.
    std::uint32_t vertex(std::uint32_t row, std::uint32_t column) const;
    glm::dvec3 direction(std::uint32_t vertex) const;

private:
    Grid grid_;
    std::vector<CosSin> down_, around_;
};

}  // namespace mray
