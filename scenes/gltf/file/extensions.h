// Which extensions of glTF a file may require.
#pragma once

#include <optional>
#include <string_view>

#include "scenes/json/json_at.h"

namespace mray::gltf {

/// Allows positions and directions of 8 and 16 bits.
inline constexpr std::string_view kQuantization = "KHR_mesh_quantization";
/// Moves, turns and scales the texture coordinates of a texture.
inline constexpr std::string_view kTextureTransform = "KHR_texture_transform";
/// Compresses buffer views.
inline constexpr std::string_view kMeshopt = "EXT_meshopt_compression";

enum class ExtensionUse {
    kRead,
    /// Its content is ignored; the triangles and where they are do not depend on it.
    kLeftOut,
    /// A file that requires it cannot be shown rightly, as far as is known.
    kUnknown
};

/// By the name alone: families of names, such as those of materials, grow.
ExtensionUse use_of_extension(std::string_view name);

/// Returns what the extension of this name says of an object; nothing if it says nothing.
std::optional<JsonAt> extension_of(const JsonAt& at, std::string_view name);

}  // namespace mray::gltf
