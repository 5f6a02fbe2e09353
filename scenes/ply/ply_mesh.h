// Collects the mesh of a PLY file while its elements are read.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scenes/mesh/mesh_file.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/ply/ply_header.h"

namespace mray {

class PlyMesh {
public:
    using Place = MeshRules::Place;

    /// Takes the roles of properties that are not read away from `header`: those that the options
    /// do not want, and colours and normals that are not complete. The number of vertices has been
    /// checked against the size of the file. `name` is the file in messages. Keeps a reference to
    /// the options.
    PlyMesh(PlyHeader& header, const std::string& name, const MeshFileOptions& options);

    std::size_t vertex_count() const { return mesh_.positions.size(); }
    /// The components of each vertex that a role has to do with.
    std::vector<vec3>& components(PlyRole role);
    /// Checks a vertex that has been read.
    void check_vertex(std::size_t vertex, const Place& place);

    /// Adds a face if the rules keep it.
    void add_face(std::span<const std::int64_t> corners, const Place& place);
    /// Adds the triangles of strips that -1 separates; every second one is turned.
    void add_strips(std::span<const std::int64_t> corners, const Place& place);
    void reserve_triangles(std::size_t count);
    /// Where to append the corners of triangles, which are below vertex_count().
    std::vector<std::uint32_t>& corners() { return mesh_.faces.corners; }
    /// Counts the triangles that have been appended.
    void count_triangles(std::size_t count, const Place& place);

    /// The mesh, once all has been read. Gives the warnings.
    FileMesh finish();

private:
    void number_corners();

    const MeshFileOptions& options_;
    std::vector<vec3> normals_;
    FileMesh mesh_;
    MeshRules rules_;
    WarningCount odd_channels_;
};

}  // namespace mray
