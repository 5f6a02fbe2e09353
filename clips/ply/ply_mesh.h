// Collects the mesh of a PLY file while its elements are read.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "clips/mesh/file_mesh.h"
#include "clips/mesh/mesh_rules.h"
#include "clips/ply/ply_header.h"

namespace mray {

class PlyMesh {
public:
    using Place = MeshRules::Place;

    /// Takes the roles of properties that are not read away from `header`: those that the options
    /// do not want, and colours and normals that are not complete. `name` is the file in messages;
    /// keeps references to it and to the options.
    PlyMesh(PlyHeader& header, const std::string& name, const MeshFileOptions& options);

    /// Makes room for all vertices; their number has been checked against the size of the file.
    void make_vertices();

    std::size_t vertex_count() const { return vertex_count_; }
    /// The three components of each vertex that a role has to do with: positions, normals, colours.
    std::vector<vec3>& components(PlyRole role);
    static int axis_of(PlyRole role);
    /// A channel of 8 bits, whose square is linear as those of images.
    static float linear_channel(std::uint8_t value) {
        const float channel = static_cast<float>(value) / 255.0f;
        return channel * channel;
    }

    /// Checks the vertices in [begin, end). `place_of` gives the place of a vertex in the file.
    void check_vertices(std::size_t begin, std::size_t end,
                        const std::function<std::string(std::size_t)>& place_of);
    void check_coordinate(float value, std::string_view text, const Place& place) {
        if (!MeshRules::is_good(value)) rules_.take_bad_coordinate(value, text, place);
    }
    /// Throws Error(kBadInput) for a channel that is not finite, or if lenient makes it 0 and
    /// counts a warning.
    void check_channel(float& value, const Place& place);

    /// Adds a face if the rules keep it.
    void add_face(std::span<const std::int64_t> corners, const Place& place);
    /// Adds faces of three corners each, which are below vertex_count().
    void add_triangles(std::span<const std::uint32_t> corners, const Place& place);
    /// Makes room for triangles, whose number has been checked against the size of the file.
    void reserve_triangles(std::uint64_t count);
    /// Adds the triangles of strips that -1 separates; every second one is turned.
    void add_strips(std::span<const std::int64_t> corners, const Place& place);

    /// The mesh, once all has been read. Gives the warnings.
    FileMesh finish();

private:
    void drop_colours(PlyElement& vertices);
    void drop_normals(PlyElement& vertices);
    void number_corners();

    const std::string& name_;
    const MeshFileOptions& options_;
    std::size_t vertex_count_ = 0;
    bool has_colours_ = false;
    bool has_normals_ = false;
    std::vector<vec3> normals_;
    FileMesh mesh_;
    MeshRules rules_;
    WarningCount odd_channels_;
};

}  // namespace mray
