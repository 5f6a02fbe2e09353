// The shapes that all levels of tests trace: ordinary meshes, and shapes on which tracers fail.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/scene/mesh.h"
#include "tests/support/random.h"

namespace mray::test {

/// A mesh around the origin, mostly within 1 of it.
struct Shape {
    std::vector<dvec3> positions;
    std::vector<uvec3> triangles;

    /// With vertices of its own.
    void add_triangle(const dvec3& a, const dvec3& b, const dvec3& c);
    void append(const Shape& other);
};

namespace shapes {

// Closed meshes with shared vertices.
Shape icosphere(int levels);
Shape torus(std::uint32_t rings, std::uint32_t sides);
Shape grid_box(std::uint32_t cells);
/// An icosphere whose vertices are 1 to 6 away from the origin.
Shape star(int levels, std::uint64_t seed);
/// The corners (0, 0, 0), (1, 0, 0), (0, 1, 0) and (0, 0, 1).
Shape tetrahedron();

/// columns x rows cells of two triangles; vertex (x, y) lies at (x, y, height(x, y)).
Shape height_map(std::uint32_t columns, std::uint32_t rows,
                 const std::function<double(std::uint32_t, std::uint32_t)>& height);

Shape soup(Random& random, int count, double size);
/// Long and thin, some with a common tip.
Shape needles(Random& random, int count);
Shape slivers(Random& random, int count);
/// Triangles several times, also turned and mirrored: with other vertices, with the same ones.
Shape duplicates(Random& random, int count);
Shape repeated(Random& random, int count);
/// Over few vertices, so that every edge and vertex has many triangles.
Shape shared_vertices(Random& random, int count, std::uint32_t vertices);
/// Overlapping triangles in one plane, or in few parallel ones at equal or almost equal distances.
Shape coplanar_stack(Random& random, int count);
/// Corners that are equal, or differ in one coordinate, by an ulp, or by the sign of a zero.
Shape equal_corners(Random& random, int count);
/// Magnitudes from 1 down to 2^-50 in one mesh.
Shape mixed_sizes(Random& random, int count);
/// Ever smaller triangles towards the origin: splits peel them off a few at a time.
Shape progression(int count);

/// A square at any angle, of 10 to 10^7 times the height of triangles above its middle.
Shape square_below(Random& random, int count);

/// A shape of any kind, mostly of 1 to 40 triangles, rarely of up to 2000.
Shape any(Random& random);

}  // namespace shapes
}  // namespace mray::test
