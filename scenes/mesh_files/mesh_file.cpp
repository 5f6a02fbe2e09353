#include "scenes/mesh_files/mesh_file.h"

#include <fmt/format.h>

#include <array>
#include <string>
#include <vector>

#include "common/text/ascii.h"
#include "scenes/obj/obj_reader.h"
#include "scenes/ply/ply_reader.h"

namespace mray {
namespace {

constexpr std::array kFormats = {
    MeshFormat{"OBJ", ".obj", "polygons, colours, textures, smooth corners", read_obj},
    MeshFormat{"PLY", ".ply", "polygons, strips, colours, smooth corners; text and binary",
               read_ply},
};

}  // namespace

std::span<const MeshFormat> mesh_formats() { return kFormats; }

const MeshFormat* mesh_format_of(const std::filesystem::path& path,
                                 std::span<const MeshFormat> more_formats) {
    const std::string extension = lower_case(path.extension().native());
    for (const std::span<const MeshFormat> formats : {mesh_formats(), more_formats}) {
        for (const MeshFormat& format : formats)
            if (format.extension == extension) return &format;
    }
    return nullptr;
}

std::string extensions_of_meshes(std::span<const MeshFormat> more_formats) {
    std::vector<std::string_view> names;
    for (const std::span<const MeshFormat> formats : {mesh_formats(), more_formats})
        for (const MeshFormat& format : formats) names.push_back(format.extension);
    const std::string_view last = names.back();
    names.pop_back();
    return fmt::format("{} or {}", fmt::join(names, ", "), last);
}

FileMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options) {
    const MeshFormat* const format = mesh_format_of(path, options.more_formats);
    return format == nullptr ? read_obj(path, options) : format->read(path, options);
}

}  // namespace mray
