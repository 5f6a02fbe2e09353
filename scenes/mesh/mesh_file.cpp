#include "scenes/mesh/mesh_file.h"

#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

#include "common/text/text_parts.h"

namespace mray {
namespace {

constexpr std::array kFormats = {
    MeshFormat{"OBJ", ".obj", "polygons, colours, textures, smooth corners", read_obj},
    MeshFormat{"PLY", ".ply", "polygons, colours, smooth corners; text and binary", read_ply},
};

}  // namespace

std::span<const MeshFormat> mesh_formats() { return kFormats; }

const MeshFormat* mesh_format_of(const std::filesystem::path& path) {
    const std::string extension = lower_case(path.extension().native());
    for (const MeshFormat& format : kFormats)
        if (format.extension == extension) return &format;
    return nullptr;
}

std::string extensions_of_meshes() {
    return fmt::format("{} or {}", kFormats[0].extension, kFormats[1].extension);
}

FileMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options) {
    const MeshFormat* const format = mesh_format_of(path);
    return format == nullptr ? read_obj(path, options) : format->read(path, options);
}

}  // namespace mray
