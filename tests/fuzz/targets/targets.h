// The readers of files that others made, each as a function of bytes.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace mray::fuzz {

/// Takes the bytes as a user would give them. Returns what is wrong with the outcome. Returns an
/// empty text if it is a value that keeps the promises of its type, or an error of the project
/// about the input (exit codes 3 and 6) in one line that names the file. Not thread-safe.
using FailureFunction = std::string (*)(std::string_view bytes);

/// An OBJ file; what follows a line `====` is the material library m.mtl beside it.
std::string obj_failure(std::string_view bytes);
std::string mtl_failure(std::string_view bytes);
std::string ply_failure(std::string_view bytes);
/// A .gltf file, or a .glb file if it begins like one.
std::string gltf_failure(std::string_view bytes);
/// Positions of a mesh of three vertices.
std::string pc2_failure(std::string_view bytes);
/// Images of `diff`, and textures.
std::string png_failure(std::string_view bytes);
std::string jpeg_failure(std::string_view bytes);

struct Target {
    /// The name of the folder with its corpus, too.
    std::string_view name;
    FailureFunction failure_of;
};
/// All of the above.
std::span<const Target> targets();

}  // namespace mray::fuzz
