#include "library/embree/committed_mesh.h"

#include <cstdio>

#include "library/embree/scene.h"

namespace mray::embree {
namespace {

/// Some programs do not show errors.
[[noreturn]] void refuse_scene(const char* what) {
    static std::once_flag once;
    std::call_once(once, [&] {
        std::fprintf(stderr, "morphray: %s not supported by morphray: no ray of such scenes hits\n",
                     what);
    });
    fail_unsupported(what);
}

}  // namespace

void CommittedMesh::place() {
    if (!is_instance()) return;
    own_positions.resize(vertices.count);
    const auto keep = [](const morphray::Vec3& p) {
        constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
        return is_in_range(p) ? p : morphray::Vec3{kNone, kNone, kNone};
    };
    to_world = instance->transform;
    to_object = inverse_of(to_world);
    for (std::size_t i = 0; i < vertices.count; ++i)
        own_positions[i] = keep(mapped(to_world, keep(vertex(static_cast<std::uint32_t>(i))), 1));
}

void CommittedMesh::make_normals() {
    own_normals.resize(triangle_count());
    std::array<std::uint32_t, 3> corners;
    for (std::size_t i = 0; i < own_normals.size(); ++i) {
        if (!find_traced_corners(i, corners)) continue;
        const auto at = [&](std::size_t corner) {
            const morphray::Vec3 p = vertex(corners[corner]);
            return glm::vec3(p.x, p.y, p.z);
        };
        const glm::vec3 normal = glm::cross(at(1) - at(0), at(2) - at(0));
        own_normals[i] = {normal.x, normal.y, normal.z};
    }
    normals = own_normals.data();
}

void CommittedMesh::find_used_vertices() {
    std::vector<std::uint8_t> is_used(vertices.count);
    used_vertices = 0;
    is_whole = true;
    std::array<std::uint32_t, 3> corners;
    for (std::size_t i = 0; i < triangle_count(); ++i) {
        if (!find_traced_corners(i, corners)) {
            is_whole = false;
            continue;
        }
        for (const std::size_t corner : corners) {
            used_vertices = std::max(used_vertices, corner + 1);
            is_used[corner] = 1;
        }
    }
    for (std::size_t i = 0; i < used_vertices; ++i) is_whole = is_whole && is_used[i] != 0;
}

void CommittedMesh::measure() {
    bounds = {};
    left_out.clear();
    bool are_in_range = true;
    Bounds all;
    for (std::size_t i = 0; i < used_vertices; ++i) {
        const morphray::Vec3 p = placed_vertex(static_cast<std::uint32_t>(i));
        are_in_range = are_in_range && is_in_range(p);
        all.add(p);
    }
    if (are_in_range && is_whole) {
        bounds = all;
        return;
    }
    std::array<std::uint32_t, 3> corners;
    for (std::size_t i = 0; i < triangle_count(); ++i) {
        if (find_traced_corners(i, corners))
            add_to_box(i, bounds);
        else
            left_out.push_back(i);
    }
}

bool CommittedMesh::add_to_box(std::size_t triangle, Bounds& box) const {
    std::array<std::uint32_t, 3> corners;
    if (!find_traced_corners(triangle, corners)) return false;
    Bounds own;
    for (const std::uint32_t corner : corners) {
        const morphray::Vec3 p = placed_vertex(corner);
        if (!is_in_range(p)) return false;
        own.add(p);
    }
    box.add(own);
    return true;
}

bool CommittedMesh::read_masks() {
    masks = {geometry->mask, is_instance() ? instance->mask : geometry->mask};
    return geometry->has_mask || (is_instance() && instance->has_mask);
}

morphray::MeshView CommittedMesh::view(std::vector<std::uint32_t>& triangles) const {
    morphray::MeshView view;
    if (used_vertices == 0) return view;
    view.positions = {vertices.data, used_vertices, vertices.stride};
    if (is_instance()) view.positions = {own_positions.data(), used_vertices};
    const std::size_t count = triangle_count();
    std::array<std::uint32_t, 3> corners;
    triangles.reserve(3 * count);
    for (std::size_t i = 0; i < count; ++i) {
        // A triangle without an area is never hit.
        if (!find_traced_corners(i, corners)) corners = {0, 0, 0};
        triangles.insert(triangles.end(), corners.begin(), corners.end());
    }
    view.triangles = triangles;
    return view;
}

void collect_meshes(const Attachments& attachments, const Ref<Geometry>& instance,
                    unsigned int inst_id, std::vector<CommittedMesh>& meshes) {
    for (const auto& [id, geometry] : attachments) {
        if (!geometry->is_enabled) continue;
        if (const char* const what = geometry->unsupported()) refuse_scene(what);
        if (!geometry->is_instance()) {
            meshes.push_back(
                {.geometry = geometry,
                 .instance = instance,
                 .versions = {geometry->version, instance ? instance->version : GeometryVersion()},
                 .geom_id = id,
                 .inst_id = inst_id,
                 .vertices = geometry->buffer(RTC_BUFFER_TYPE_VERTEX, 0),
                 .indices = geometry->buffer(RTC_BUFFER_TYPE_INDEX, 0),
                 .is_quads = geometry->is_quads()});
        } else if (instance.get() != nullptr) {
            refuse_scene("instances of scenes with instances are");
        } else if (const SceneObject* const scene = geometry->instanced.get()) {
            collect_meshes(scene->attachments(), geometry, id, meshes);
        }
    }
}

}  // namespace mray::embree
