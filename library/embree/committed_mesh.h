// The meshes of a scene, those of its instances among them.
#pragma once

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include "library/embree/geometry.h"
#include "morphray/mesh.hpp"

namespace mray::embree {

/// Embree leaves out primitives with vertices so far away that squares of lengths overflow.
inline bool is_in_range(const morphray::Vec3& p) {
    constexpr float kLimit = 1.844e18f;
    return std::abs(p.x) < kLimit && std::abs(p.y) < kLimit && std::abs(p.z) < kLimit;
}

/// A box has lower > upper if nothing is in it.
struct Bounds {
    glm::vec3 lower{std::numeric_limits<float>::infinity()};
    glm::vec3 upper{-std::numeric_limits<float>::infinity()};

    void add(const morphray::Vec3& p) { add({{p.x, p.y, p.z}, {p.x, p.y, p.z}}); }
    void add(const Bounds& other) {
        lower = glm::min(lower, other.lower);
        upper = glm::max(upper, other.upper);
    }
    float distance2(const glm::vec3& point) const {
        const glm::vec3 beside = glm::max(glm::max(lower - point, 0.0f), point - upper);
        return glm::dot(beside, beside);
    }
};

/// A mesh as a scene was committed with it. What it reads of the caller stays alive with it.
struct CommittedMesh {
    Ref<Geometry> geometry;
    /// Null if the mesh is attached to the scene itself.
    Ref<Geometry> instance;
    /// The versions of mesh and instance at the last commit.
    std::array<GeometryVersion, 2> versions = {};
    unsigned int geom_id = kInvalid;
    unsigned int inst_id = kInvalid;
    BufferView vertices = {};
    BufferView indices = {};
    bool is_quads = false;
    /// Vertices behind the last one of a triangle, as Blender adds, may be unset memory.
    std::size_t used_vertices = 0;
    /// Whether the tracer has all triangles, and each of the used_vertices belongs to one.
    bool is_whole = false;
    /// A ray passes by if it shares no bit with the mask of the mesh or with that of the instance.
    std::array<unsigned int, 2> masks = {};
    Transform to_world = Transform(1.0);
    Transform to_object = Transform(1.0);
    /// Of instances, in the space of the scene. Vertices that are out of range are NaN.
    std::vector<morphray::Vec3> own_positions = {};
    /// Around the triangles that can be hit, in the space of the scene.
    Bounds bounds = {};
    /// The triangles without traced corners when the tracer was given the others.
    std::vector<std::size_t> left_out = {};
    /// The cross product of each triangle's edges, in the space of the mesh, which saves up to a
    /// quarter of a hit's time. The meshes of one geometry share them.
    const morphray::Vec3* normals = nullptr;
    std::vector<morphray::Vec3> own_normals = {};

    bool is_instance() const { return instance.get() != nullptr; }
    std::size_t triangle_count() const { return indices.count * (is_quads ? 2 : 1); }
    unsigned int prim_id(std::uint32_t triangle) const {
        return is_quads ? triangle / 2 : triangle;
    }
    /// Finds the vertices of a triangle that the tracer has. False if an index is out of range, or
    /// a vertex of a quad: else its other half would be hit.
    bool find_traced_corners(std::size_t triangle, std::array<std::uint32_t, 3>& corners) const {
        const std::size_t count = vertices.count;
        if (!is_quads) {
            const auto* const ids = indices.at<std::uint32_t>(triangle);
            corners = {ids[0], ids[1], ids[2]};
            return ids[0] < count && ids[1] < count && ids[2] < count;
        }
        const auto* const ids = indices.at<std::uint32_t>(triangle / 2);
        if (triangle % 2 == 0)
            corners = {ids[0], ids[1], ids[3]};
        else
            corners = {ids[2], ids[3], ids[1]};
        return std::all_of(ids, ids + 4,
                           [&](std::uint32_t id) { return id < count && is_in_range(vertex(id)); });
    }
    morphray::Vec3 vertex(std::uint32_t index) const {
        const auto* const p = vertices.at<float>(index);
        return {p[0], p[1], p[2]};
    }
    morphray::Vec3 placed_vertex(std::uint32_t index) const {
        return is_instance() ? own_positions[index] : vertex(index);
    }
    bool sees(unsigned int ray_mask) const {
        return (masks[0] & ray_mask) != 0 && (masks[1] & ray_mask) != 0;
    }

    /// Computes the transformations of instances, and own_positions.
    void place();
    void make_normals();
    void find_used_vertices();
    void measure();
    /// Adds a triangle; false, and nothing is added, without three corners in range.
    bool add_to_box(std::size_t triangle, Bounds& box) const;
    /// Reads masks again. Returns whether any was set by the caller.
    bool read_masks();
    /// For Scene::build(). `triangles` gets the vertices of triangles.
    morphray::MeshView view(std::vector<std::uint32_t>& triangles) const;
};

using Attachments = std::map<unsigned int, Ref<Geometry>>;

/// Appends the enabled meshes of a scene, or of an instance, by ascending ID. Throws Failure.
void collect_meshes(const Attachments& attachments, const Ref<Geometry>& instance,
                    unsigned int inst_id, std::vector<CommittedMesh>& meshes);

}  // namespace mray::embree
