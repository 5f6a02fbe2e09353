// Files of tests as meshes and animations, with their warnings.
#pragma once

#include <string>
#include <vector>

#include "scenes/mesh/mesh_file.h"
#include "tests/support/animation_positions.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray::test {

struct OpenedScene {
    explicit OpenedScene(const std::string& spec, AnimationOptions options = {}) {
        options.warn = [this](const Warning& warning) { warnings.push_back(warning.line()); };
        animation = open_scene(spec, options);
    }
    OpenedScene(const OpenedScene&) = delete;

    const Topology& topology() const { return animation->topology(); }
    std::vector<vec3> at(double frame) const { return positions_at(*animation, frame); }

    std::vector<std::string> warnings;
    std::unique_ptr<Animation> animation;
};

struct ReadMesh {
    FileMesh mesh;
    std::vector<std::string> warnings;
};

/// `reader` is read_obj() or read_ply().
template <class Reader>
ReadMesh read_mesh(Reader reader, const std::filesystem::path& file, MeshFileOptions options = {}) {
    ReadMesh read;
    options.warn = [&](const Warning& warning) { read.warnings.push_back(warning.line()); };
    read.mesh = reader(file, options);
    return read;
}

/// The message of the error that a call throws, without the folder; empty if it throws none.
template <class Call>
std::string message_without(const TemporaryFolder& folder, const Call& call) {
    std::string text = message_of(call);
    const std::string prefix = folder.file("");
    for (std::size_t at = text.find(prefix); at != text.npos; at = text.find(prefix))
        text.erase(at, prefix.size());
    return text;
}

}  // namespace mray::test
