// The container of a binary glTF file (GLB).
#pragma once

#include <string>
#include <string_view>

namespace mray::gltf {

/// Parts of the bytes of a GLB file; `binary` has no data if there is no such chunk.
struct Glb {
    std::string_view json;
    std::string_view binary;
};

bool is_glb(std::string_view bytes);

/// Finds the chunks of a GLB file (version 2), of which those of unknown types are skipped. `file`
/// is the file in messages. Throws Error(kBadInput) for another version and for lengths that are
/// not those of the file, with the byte.
Glb split_glb(std::string_view bytes, const std::string& file);

}  // namespace mray::gltf
