#include "scenes/keyframes/first_mesh.h"

#include <utility>

#include "common/text/message_text.h"
#include "scenes/mesh_files/mesh_file.h"
#include "scenes/polygons/triangulate.h"

namespace mray {
namespace {

/// Gives the triangles that the faces were divided into what their corners have.
void set_corners(const FileMesh& mesh, std::span<const uvec3> triangles, std::vector<uvec3>& smooth,
                 SceneTextures& textures) {
    if (mesh.smooth.empty() && mesh.textures.empty()) return;
    const std::vector<uvec3> corners = corners_of_triangles(mesh.faces, triangles);
    if (!mesh.smooth.empty()) {
        smooth.reserve(corners.size());
        for (const uvec3& t : corners)
            smooth.emplace_back(mesh.smooth[t.x], mesh.smooth[t.y], mesh.smooth[t.z]);
    }
    if (mesh.textures.empty()) return;
    textures.files = mesh.textures;
    textures.texcoords.reserve(corners.size());
    for (const uvec3& t : corners)
        textures.texcoords.push_back(
            {mesh.texcoords[t.x], mesh.texcoords[t.y], mesh.texcoords[t.z]});
    textures.texture_ids.reserve(corners.size());
    for (std::size_t face = 0; face < mesh.face_textures.size(); ++face) {
        textures.texture_ids.insert(textures.texture_ids.end(), mesh.faces.corner_counts[face] - 2,
                                    mesh.face_textures[face]);
    }
}

void set_albedo(const FileMesh& mesh, Topology& topology) {
    if (mesh.albedo.empty() && mesh.vertex_colours.empty()) {
        topology.albedo.assign(topology.triangles.size(), kDefaultAlbedo);
        return;
    }
    topology.albedo.reserve(topology.triangles.size());
    for (std::size_t face = 0; face < mesh.albedo.size(); ++face) {
        topology.albedo.insert(topology.albedo.end(), mesh.faces.corner_counts[face] - 2,
                               mesh.albedo[face]);
    }
    if (mesh.vertex_colours.empty()) return;
    for (const uvec3& t : topology.triangles) {
        const std::vector<vec3>& colours = mesh.vertex_colours;
        const vec3 mean = (colours[t.x] + colours[t.y] + colours[t.z]) / 3.0f;
        topology.albedo.push_back(albedo_of(mean.x, mean.y, mean.z));
    }
}

}  // namespace

FirstMesh read_first_mesh(const std::filesystem::path& path, const ClipOptions& options) {
    FileMesh mesh = read_mesh_file(path, {.lenient = options.lenient,
                                          .allow_empty = options.allow_empty,
                                          .normals = true,
                                          .textures = true,
                                          .more_formats = options.more_formats,
                                          .warn = options.warn});
    FirstMesh first;
    Topology& topology = first.topology;
    topology.vertex_count = static_cast<std::uint32_t>(mesh.positions.size());
    topology.triangles =
        triangulate(mesh.faces, mesh.positions, shown(path), options.lenient, options.warn);
    set_corners(mesh, topology.triangles, first.smooth, first.textures);
    set_albedo(mesh, topology);
    first.faces = std::move(mesh.faces);
    first.positions = std::move(mesh.positions);
    return first;
}

}  // namespace mray
