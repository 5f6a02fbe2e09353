#include "scenes/animation.h"

#include <fmt/format.h>

#include <filesystem>

#include "common/text/text.h"
#include "scenes/gltf/gltf_animation.h"
#include "scenes/mesh/mesh_file.h"
#include "scenes/procedural/procedural.h"
#include "scenes/sequence/pc2.h"
#include "scenes/sequence/streamed_animation.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBuiltinPrefix = "builtin:";

std::unique_ptr<Animation> open_builtin(const std::string& spec) {
    const std::string_view rest = std::string_view(spec).substr(kBuiltinPrefix.size());
    const std::size_t colon = rest.find(':');
    const std::string name(rest.substr(0, colon));
    if (colon == std::string_view::npos) return make_procedural(name);
    const auto triangles = parse_integer(rest.substr(colon + 1));
    if (!triangles || *triangles <= 0) {
        throw Error(ErrorKind::kBadArgument,
                    "scene {}: {} is not a number of triangles; write builtin:NAME:TRIANGLES, such "
                    "as builtin:cloth:100000",
                    quote(spec), quote(rest.substr(colon + 1)));
    }
    return make_procedural(name, static_cast<std::uint64_t>(*triangles));
}

/// Refuses the name of a built-in scene without its prefix.
void require_no_builtin(const std::string& spec) {
    const std::string name = spec.substr(0, spec.find(':'));
    for (const ProceduralScene& scene : procedural_scenes()) {
        if (name != scene.name) continue;
        throw Error(ErrorKind::kBadInput, "{}: no such file; did you mean {}{}?", escape(spec),
                    kBuiltinPrefix, spec);
    }
}

std::unique_ptr<Animation> open_with_cache(const std::string& spec,
                                           const AnimationOptions& options) {
    std::error_code error;
    const fs::path path(spec);
    if (spec.starts_with(kBuiltinPrefix) || fs::is_directory(path, error) || !has_mesh_name(path)) {
        throw Error(ErrorKind::kBadArgument,
                    "scene {}: the positions of a point cache need one .obj or .ply file with "
                    "their triangles",
                    quote(spec));
    }
    return open_cached(path, options.cache, spec, options);
}

}  // namespace

std::unique_ptr<Animation> open_scene(const std::string& spec, const AnimationOptions& options) {
    if (spec.empty()) {
        throw Error(ErrorKind::kBadArgument,
                    "empty scene name; give builtin:NAME, a file, a folder or a pattern");
    }
    if (!options.animation.empty() && !has_gltf_name(spec)) {
        throw Error(ErrorKind::kBadArgument,
                    "scene {}: only .gltf and .glb files have animations to choose", quote(spec));
    }
    if (!options.cache.empty()) return open_with_cache(spec, options);
    if (spec.starts_with(kBuiltinPrefix)) return open_builtin(spec);

    // An existing file is opened as such even if its name contains '%'.
    std::error_code error;
    const fs::path path(spec);
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status))
        return open_keyframes(files_of_folder(path, options), spec, options);
    if (status.type() == fs::file_type::not_found) {
        if (spec.find_first_of("%*") != std::string::npos)
            return open_keyframes(files_of_pattern(spec, options), spec, options);
        require_no_builtin(spec);
    }
    if (has_gltf_name(path)) return open_gltf(path, spec, options);
    if (fs::is_regular_file(status) && !has_mesh_name(path)) {
        throw Error(ErrorKind::kBadInput,
                    "{}: not a scene file; give an .obj or .ply file, a folder of those, a "
                    "pattern, a .gltf or .glb file, or builtin:NAME",
                    escape(path));
    }
    return open_keyframes({{0.0, path}}, spec, options);
}

}  // namespace mray
