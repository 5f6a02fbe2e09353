// A mesh as a file has it, and the formats that are read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/interop/platform.h"
#include "common/scene/mesh.h"
#include "common/scene/origin.h"
#include "common/scene/textures.h"
#include "scenes/polygons/triangulate.h"

namespace mray {

struct MeshFileOptions {
    /// Accept bad coordinates and leave out faces that cannot be read, with a warning each.
    bool lenient = false;
    /// Leave out colours, material libraries, normals and textures.
    bool positions_only = false;
    /// That of the animation; nothing: found by origin_of().
    std::optional<Origin> origin = {};
    WarnFunction warn = {};
};

/// The albedo of triangles without material: clay, which no part of the background looks like.
inline constexpr Albedo kClay = 0x0033548A;

/// The faces of the file that have three corners or more, in their order.
struct FileMesh {
    Origin origin;
    /// Whether the origin rounds them coarsely: they are too far from it.
    bool is_coarse = false;
    /// Each vertex of the file, in world space (Origin::to_world()).
    std::vector<vec3> positions;
    Polygons faces;
    /// For each face of more than three corners its line, or in binary data its byte.
    std::vector<std::uint64_t> polygon_places;
    /// What stands before them in messages: "mesh.obj:" or "mesh.ply: byte ".
    std::string place_prefix;
    /// One for each face, or for the first of them; kClay for all others.
    std::vector<Albedo> albedo;
    /// Linear colours, or empty. Triangles that `albedo` leaves kClay have the mean of their three.
    std::vector<vec3> vertex_colours;
    /// A number a corner, which those of one position and normal share. Empty without normals.
    std::vector<std::uint32_t> smooth;
    /// The textures that faces use. If there are none, the arrays below are empty, too.
    std::vector<TextureFile> textures;
    /// For each face an index of `textures`, or kNoTexture.
    std::vector<std::uint32_t> face_textures;
    /// For each corner of `faces`; 0 where a face has no texture.
    std::vector<Texcoord> texcoords;
};

/// Reads positions and colours of vertices, faces, normals for FileMesh::smooth alone, and from
/// material libraries diffuse colours and the names of textures. Faces whose texture is missing
/// have their colour alone, with a warning. Keeps degenerate faces. Throws Error: kBadInput with
/// file and line, kLimit (4 GiB, 2^28 triangles). Thread-safe if each call has its options.
FileMesh read_obj(const std::filesystem::path& path, const MeshFileOptions& options = {});

/// Reads a PLY file (Greg Turk, "The PLY Polygon File Format", 1994), in text or binary with either
/// order of bytes: faces and strips. Integer colours are those of images, whose squares are linear;
/// others are linear. Vertices with equal positions and normals are smooth together. Throws Error:
/// kBadInput with the line or the byte, kLimit. Thread-safe as read_obj().
FileMesh read_ply(const std::filesystem::path& path, const MeshFileOptions& options = {});

/// Whether the name ends with .obj or .ply, in letters of either case.
bool has_mesh_name(const std::filesystem::path& path);

/// By the format of its name, else as OBJ. Throws Error: kBadInput with the place, kLimit.
FileMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options);

/// Sets the origin and the positions of a mesh from the coordinates of its file.
void set_positions(FileMesh& mesh, std::span<const glm::dvec3> file,
                   const MeshFileOptions& options);

/// `name` is the file and `kind` its format in the message: "an OBJ file".
void require_faces(const FileMesh& mesh, const std::string& name, std::string_view kind);

}  // namespace mray
