#include "scenes/procedural/parts/swaying_mesh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

#include "scenes/procedural/parts/surfaces.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr double kFramesOfSwing = 12;

bool moves(const SwayingVertex& vertex) { return vertex.sway != glm::dvec3(0); }

/// A unit vector perpendicular to a unit vector.
glm::dvec3 any_perpendicular(const glm::dvec3& axis) {
    const glm::dvec3 other = std::abs(axis.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    const glm::dvec3 across = glm::cross(axis, other);
    return across / glm::length(across);
}

}  // namespace

std::uint32_t TubeShape::segments_for(std::uint64_t triangles, std::uint32_t sides) {
    const std::uint64_t ends = triangle_count(sides, 0);
    const std::uint64_t walls = triangles > ends ? triangles - ends : 0;
    return static_cast<std::uint32_t>(std::max<std::uint64_t>(1, walls / (2 * sides)));
}

std::uint32_t SwayingMesh::add_vertex(const SwayingVertex& vertex) {
    vertices_.push_back(vertex);
    return mesh_.topology.vertex_count++;
}

void SwayingMesh::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, Albedo albedo) {
    mesh_.topology.triangles.push_back({a, b, c});
    mesh_.topology.albedo.push_back(albedo);
}

void SwayingMesh::add_quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d,
                           Albedo albedo) {
    add_triangle(a, b, c, albedo);
    add_triangle(a, c, d, albedo);
}

void SwayingMesh::add_box(const BoxShape& box, Albedo albedo) {
    const std::uint32_t first = mesh_.topology.vertex_count;
    for (std::uint32_t i = 0; i < 8; ++i) {
        const glm::dvec3 corner = box.middle + ((i & 1) != 0 ? box.x : -box.x) +
                                  ((i & 2) != 0 ? box.y : -box.y) + ((i & 4) != 0 ? box.z : -box.z);
        add_vertex({.rest = corner});
    }
    constexpr std::uint32_t kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                            {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& f : kFaces)
        add_quad(first + f[0], first + f[1], first + f[2], first + f[3], albedo);
}

void SwayingMesh::add_box(const glm::dvec3& lower, const glm::dvec3& upper, Albedo albedo) {
    const glm::dvec3 half = 0.5 * (upper - lower);
    add_box({0.5 * (lower + upper), {half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}}, albedo);
}

void SwayingMesh::add_room(const glm::dvec3& lower, const glm::dvec3& upper, Albedo albedo) {
    const glm::dvec3 half = 0.5 * (upper - lower);
    // Left-handed axes turn every face around.
    add_box({0.5 * (lower + upper), {-half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}}, albedo);
}

void SwayingMesh::add_tube(const TubeShape& tube, Albedo albedo) {
    assert(tube.sides >= 3 && tube.segments >= 1);
    const glm::dvec3 along = tube.to - tube.from;
    const glm::dvec3 axis = along / glm::length(along);
    const glm::dvec3 u = any_perpendicular(axis);
    const glm::dvec3 v = glm::cross(axis, u);
    const std::uint32_t first = mesh_.topology.vertex_count;
    for (std::uint32_t ring = 0; ring <= tube.segments; ++ring) {
        const double s = static_cast<double>(ring) / tube.segments;
        const double radius = tube.radius + 4 * s * (1 - s) * (tube.middle_radius - tube.radius);
        for (std::uint32_t side = 0; side < tube.sides; ++side) {
            const CosSin around = circle_point(static_cast<double>(side) / tube.sides);
            add_vertex(
                {.rest = tube.from + s * along + radius * (around.cos * u + around.sin * v)});
        }
    }
    const auto at = [&](std::uint32_t ring, std::uint32_t side) {
        return first + ring * tube.sides + side % tube.sides;
    };
    for (std::uint32_t ring = 0; ring < tube.segments; ++ring) {
        for (std::uint32_t side = 0; side < tube.sides; ++side)
            add_quad(at(ring, side), at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side),
                     albedo);
    }
    for (std::uint32_t side = 1; side + 1 < tube.sides; ++side) {
        add_triangle(at(0, 0), at(0, side + 1), at(0, side), albedo);
        add_triangle(at(tube.segments, 0), at(tube.segments, side), at(tube.segments, side + 1),
                     albedo);
    }
}

void SwayingMesh::add_sphere(const glm::dvec3& middle, double radius, std::uint64_t triangles,
                             Albedo albedo) {
    const Sphere sphere(triangles);
    Topology topology;
    sphere.append_to(topology, [&](std::uint32_t, std::uint32_t) { return albedo; });
    const std::uint32_t first = mesh_.topology.vertex_count;
    for (std::uint32_t i = 0; i < sphere.vertex_count(); ++i)
        add_vertex({.rest = middle + radius * sphere.direction(i)});
    for (const uvec3& t : topology.triangles)
        add_triangle(first + t.x, first + t.y, first + t.z, albedo);
}

void SwayingMesh::add_sheet(std::uint32_t rows, std::uint32_t columns, Albedo albedo,
                            const std::function<SwayingVertex(double s, double t)>& at) {
    const std::uint32_t first = mesh_.topology.vertex_count;
    for (std::uint32_t row = 0; row <= rows; ++row) {
        for (std::uint32_t column = 0; column <= columns; ++column)
            add_vertex(at(static_cast<double>(column) / columns, static_cast<double>(row) / rows));
    }
    for (std::uint32_t row = 0; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const std::uint32_t a = first + row * (columns + 1) + column;
            const std::uint32_t d = a + columns + 1;
            add_quad(a, d, d + 1, a + 1, albedo);
        }
    }
}

DeformingMesh SwayingMesh::finish() && {
    const auto& triangles = mesh_.topology.triangles;
    const auto first_moving = std::find_if(triangles.begin(), triangles.end(), [&](const uvec3& t) {
        return moves(vertices_[t.x]) || moves(vertices_[t.y]) || moves(vertices_[t.z]);
    });
    mesh_.static_triangle_count = static_cast<std::uint32_t>(first_moving - triangles.begin());
    mesh_.move = [vertices = std::move(vertices_)](double frame, VertexRange range,
                                                   std::span<vec3> out) {
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const SwayingVertex& v = vertices[i];
            out[i] = round_to_float(
                moves(v) ? v.rest + sin_turns(frame / kFramesOfSwing + v.phase) * v.sway : v.rest);
        }
    };
    return std::move(mesh_);
}

}  // namespace mray
