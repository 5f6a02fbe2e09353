// Scenes of many static parts and some that sway: boxes, tubes, spheres and sheets.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <glm/vec3.hpp>

#include "common/scene/mesh.h"
#include "scenes/procedural/deforming_mesh.h"

namespace mray {

/// A vertex that swings through `rest` by `sway` to both sides, once in 12 frames, from a phase in
/// turns.
struct SwayingVertex {
    glm::dvec3 rest;
    glm::dvec3 sway{0};
    double phase = 0;
};

/// A box by its middle and its half axes, which are perpendicular and right-handed.
struct BoxShape {
    glm::dvec3 middle;
    glm::dvec3 x, y, z;
};

/// A round bar from `from` to `to`, which differ, with closed ends; `radius` at both ends and
/// `middle_radius` between them.
struct TubeShape {
    glm::dvec3 from, to;
    double radius;
    double middle_radius;
    /// Around, at least 3, and along, at least 1.
    std::uint32_t sides;
    std::uint32_t segments;

    static std::uint64_t triangle_count(std::uint32_t sides, std::uint32_t segments) {
        return std::uint64_t{2} * sides * segments + 2 * (sides - 2);
    }
    /// The segments of a tube of about that many triangles; at least 1.
    static std::uint32_t segments_for(std::uint64_t triangles, std::uint32_t sides);
};

/// Collects parts. Those that sway come last, so that the others are the static triangles.
class SwayingMesh {
public:
    std::uint64_t triangle_count() const { return mesh_.topology.triangles.size(); }

    /// Twelve triangles, counter-clockwise from outside.
    void add_box(const BoxShape& box, Albedo albedo);
    /// The box [lower, upper].
    void add_box(const glm::dvec3& lower, const glm::dvec3& upper, Albedo albedo);
    /// The same box seen from inside: a room.
    void add_room(const glm::dvec3& lower, const glm::dvec3& upper, Albedo albedo);
    void add_tube(const TubeShape& tube, Albedo albedo);
    /// A sphere of about that many triangles, at least 6.
    void add_sphere(const glm::dvec3& middle, double radius, std::uint64_t triangles,
                    Albedo albedo);
    /// An open sheet of rows x columns quads; at(s, t) gives the vertices for s (along a row) and t
    /// (down the rows) from 0 to 1.
    void add_sheet(std::uint32_t rows, std::uint32_t columns, Albedo albedo,
                   const std::function<SwayingVertex(double s, double t)>& at);

    /// Adds a vertex, or a triangle of vertices that exist; returns the vertex.
    std::uint32_t add_vertex(const SwayingVertex& vertex);
    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, Albedo albedo);

    DeformingMesh finish() &&;

private:
    void add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                  Albedo albedo);

    DeformingMesh mesh_;
    std::vector<SwayingVertex> vertices_;
};

}  // namespace mray
