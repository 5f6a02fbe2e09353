// Diffuse colours and textures of a material library.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>

#include "common/scene/mesh.h"
#include "scenes/warning_count.h"

namespace mray {

/// A `map_Kd` statement. Texture coordinates are multiplied by `scale`, then `offset` is added.
struct TextureMap {
    /// As the library names it, with / for each backslash.
    std::string file;
    bool clamp = false;
    std::array<float, 2> scale = {1, 1};
    std::array<float, 2> offset = {0, 0};
    /// "file:line" of the statement.
    std::string place;
    /// The library, which file names are relative to.
    std::filesystem::path library;
};

struct Material {
    Albedo albedo = kDefaultAlbedo;
    /// The albedo below the texture: white where the library has no Kd, or a black one.
    Albedo textured_albedo = 0x00FFFFFF;
    /// Null without a texture.
    std::shared_ptr<const TextureMap> map;
};

using MaterialMap = std::unordered_map<std::string, Material>;

/// More than a library of a million materials takes.
inline constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{256} << 20;

/// Adds the materials of an MTL text to `materials`, by their names without the blanks around them;
/// the first of several materials of one name stays. The albedo is Kd, taken as linear, clamped to
/// [0, 1] and rounded to 8 bits; kDefaultAlbedo without a Kd. Of the options of map_Kd, -s, -o and
/// -clamp are read.
///
/// `library` is the file, `name` the same in messages. Throws Error(kBadInput) for NUL bytes, for a
/// Kd without three finite numbers and for options of map_Kd without their values; if lenient,
/// warns and takes the default, or no texture, for the latter two.
void read_mtl_text(std::string_view text, const std::filesystem::path& library,
                   const std::string& name, bool lenient, const WarnFunction& warn,
                   MaterialMap& materials);

}  // namespace mray
