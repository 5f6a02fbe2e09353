#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <array>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <string>
#include <string_view>

#include "app/files/formats/assimp_mesh.h"
#include "app/files/formats/optional_formats.h"
#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/base/stopwatch.h"
#include "common/text/message_text.h"
#include "scenes/mesh/mesh_rules.h"

namespace mray::app {
namespace {

constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;
constexpr double kMostMs = 60'000;

/// Ends the reading of a file that takes too long.
class TimeLimit : public Assimp::ProgressHandler {
public:
    bool Update(float) override { return watch_.ms() < kMostMs; }
    bool is_over() const { return watch_.ms() >= kMostMs; }

private:
    const Stopwatch watch_{};
};

/// Reads the bytes of the file alone: files that it names are not opened.
FileMesh read_with_assimp(const std::filesystem::path& path, const MeshFileOptions& options,
                          const char* extension) {
    const std::string name = shown(path);
    HeldWarnings warnings;
    MeshFileOptions held = options;
    held.warn = warnings.keeper();
    const std::string bytes = read_input_file(path, kMaxBytes);
    Assimp::Importer importer;
    auto* const limit = new TimeLimit;  // the importer owns it
    importer.SetProgressHandler(limit);
    const aiScene* const scene = importer.ReadFileFromMemory(
        bytes.data(), bytes.size(), aiProcess_ValidateDataStructure, extension);
    if (scene == nullptr && limit->is_over()) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{}: takes more than {:.0f} s to read; simplify it or write it as "
                                "PLY",
                                name, kMostMs / 1000));
    }
    if (scene == nullptr) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: assimp cannot read it: {}; write it again or as PLY", name,
                                in_quotes(importer.GetErrorString())));
    }
    FileMesh mesh = mesh_of(*scene, name, held);
    require_faces(mesh, name, fmt::format("a complete {} file", extension), held);
    warnings.tell(options.warn);
    return mesh;
}

FileMesh read_fbx(const std::filesystem::path& path, const MeshFileOptions& options) {
    return read_with_assimp(path, options, "fbx");
}
FileMesh read_dae(const std::filesystem::path& path, const MeshFileOptions& options) {
    return read_with_assimp(path, options, "dae");
}
FileMesh read_stl(const std::filesystem::path& path, const MeshFileOptions& options) {
    return read_with_assimp(path, options, "stl");
}

constexpr std::array kFormats = {
    MeshFormat{"FBX", ".fbx", "polygons and colours of the first pose, by assimp", read_fbx},
    MeshFormat{"Collada", ".dae", "polygons and colours of the first pose, by assimp", read_dae},
    MeshFormat{"STL", ".stl", "triangles, by assimp", read_stl},
};

}  // namespace

std::span<const MeshFormat> optional_mesh_formats() { return kFormats; }

}  // namespace mray::app
