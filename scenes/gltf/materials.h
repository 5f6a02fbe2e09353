// Colours and textures of a glTF file's materials.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/scene/mesh.h"
#include "common/scene/textures.h"
#include "scenes/clip_options.h"
#include "scenes/gltf/gltf_file.h"
#include "scenes/gltf/meshes.h"

namespace mray::gltf {

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

    TexcoordUses texcoord_uses() const;
};

/// Reads baseColorFactor and baseColorTexture of every material. Images are files in the
/// folder of the glTF file, data: URIs, or parts of a buffer; those that are missing or lie outside
/// of the folder, data: URIs that are not in base 64, and those of unknown extensions are left out
/// with a warning. Throws Error(kBadInput) for indices out of range and factors that are no
/// numbers.
Materials read_materials(const GltfFile& file, const ClipOptions& options);

}  // namespace mray::gltf
