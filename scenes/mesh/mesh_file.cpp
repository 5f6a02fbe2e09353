#include "scenes/mesh/mesh_file.h"

#include "common/base/errors.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

std::string extension_of(const std::filesystem::path& path) {
    return lower_case(path.extension().native());
}

}  // namespace

bool has_mesh_name(const std::filesystem::path& path) {
    const std::string extension = extension_of(path);
    return extension == ".obj" || extension == ".ply";
}

FileMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options) {
    return extension_of(path) == ".ply" ? read_ply(path, options) : read_obj(path, options);
}

void set_positions(FileMesh& mesh, std::span<const glm::dvec3> file,
                   const MeshFileOptions& options) {
    mesh.origin = options.origin ? *options.origin : origin_of(file);
    mesh.positions = mesh.origin.to_world(file);
    mesh.is_coarse = options.origin && mesh.origin.rounds_coarsely(file);
}

void require_faces(const FileMesh& mesh, const std::string& name, std::string_view kind) {
    if (!mesh.faces.corner_counts.empty()) return;
    const char* const missing = mesh.positions.empty() ? "no vertices" : "no faces";
    throw Error(ErrorKind::kBadInput, "{}: {}; is it {}?", name, missing, kind);
}

}  // namespace mray
