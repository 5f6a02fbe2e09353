// Colours and textures of a glTF file's materials.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/scene/mesh.h"
#include "common/scene/textures.h"
#include "scenes/clip.h"
#include "scenes/gltf/gltf_file.h"

namespace mray::gltf {

/// A point of an image, glTF's (u, v) with v from the top, is (u[0] * u + u[1] * v + u[2], v[0] * u
/// + v[1] * v + v[2]).
struct TexcoordMap {
    std::array<double, 3> u = {1, 0, 0};
    std::array<double, 3> v = {0, 1, 0};
    bool operator==(const TexcoordMap&) const = default;
};

/// The texture coordinates that a material wants: attribute TEXCOORD_n, and where it maps them.
struct TexcoordUse {
    std::uint32_t set = 0;
    TexcoordMap map = {};
};

struct Material {
    /// White where the file does not say.
    Albedo albedo = 0x00FFFFFF;
    /// An index of Materials::textures, or kNoTexture.
    std::uint32_t texture = kNoTexture;
    /// The texture coordinates of the texture.
    TexcoordUse texcoords = {};
    /// Whether its alpha mode MASK leaves nothing, whatever the texture.
    bool is_cut_away = false;
};

struct Materials {
    std::vector<Material> materials;
    std::vector<TextureFile> textures;
};

/// Reads baseColorFactor and baseColorTexture of every material. Images are files in the
/// folder of the glTF file, data: URIs, or parts of a buffer; those that are missing or lie outside
/// of the folder, data: URIs that are not in base 64, and those of unknown extensions are left out
/// with a warning. Throws Error(kBadInput) for indices out of range and factors that are no
/// numbers.
Materials read_materials(const GltfFile& file, const ClipOptions& options);

}  // namespace mray::gltf
