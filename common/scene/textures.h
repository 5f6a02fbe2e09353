// Textures of a scene: which images its triangles show, and where on them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mray {

/// Stands for the number of a texture of a triangle that has none.
inline constexpr std::uint32_t kNoTexture = 0xFFFFFFFFu;

/// A point of an image: u from its left side (0) to the right (1), v from below (0) to the top (1).
struct Texcoord {
    float u = 0;
    float v = 0;
    bool operator==(const Texcoord&) const = default;
};

using Texcoords = std::array<Texcoord, 3>;

/// An image file, and whether its border pixels go on outside of it; otherwise it repeats.
struct TextureFile {
    std::string path = {};
    bool clamp = false;
    /// From 0 to 1: where its alpha is below this, it has holes. 0: nowhere.
    float alpha_cutoff = 0;
    /// The part of the file that is the image, in bytes; size 0: all of it.
    std::uint64_t offset = 0;
    std::uint64_t size = 0;
    /// Where in the file at `path` the image stands, for messages, such as "images[3]"; empty: it
    /// is the file.
    std::string place = {};
    /// Bytes that stand in the file in base 64, of which the image is a part; null: the file's.
    std::shared_ptr<const std::string> content = {};
    bool operator==(const TextureFile&) const = default;
};

/// The textures of a mesh, the same in all frames. A triangle's colour is the product of its albedo
/// and its texture. Without files all are empty, else the others have an entry for each triangle.
struct SceneTextures {
    std::vector<TextureFile> files;
    std::vector<Texcoords> texcoords;
    std::vector<std::uint32_t> texture_ids;
};

}  // namespace mray
