// Textures: images that triangles show.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/interop/platform.h"
#include "common/scene/textures.h"

namespace mray::cpu {

/// The square of 255: a channel of linear colours that textures give.
inline constexpr std::uint32_t kTexelOne = 65025;

/// An image with its smaller levels, each half as wide and high (L. Williams. Pyramidal
/// parametrics. 1983). A texel's 8-bit channels are taken as square roots of linear intensities, as
/// those of images are; its alpha is not read. All arithmetic is of whole numbers but for the
/// rounding of coordinates, which single floating-point operations do.
class Texture {
public:
    /// `texels`: width * height of them, row by row from the top, R in bits 0-7, G in 8-15, B in
    /// 16-23; neither side is 0 or above 2^14. Outside of the image its border is repeated (clamp),
    /// or the image. O(texels).
    Texture(std::span<const std::uint32_t> texels, std::uint32_t width, std::uint32_t height,
            bool clamp);

    std::uint32_t width() const { return levels_[0].width; }
    std::uint32_t height() const { return levels_[0].height; }
    std::size_t level_count() const { return levels_.size(); }
    /// The texels of a level, packed as in the image, without alpha.
    std::span<const std::uint32_t> level(std::size_t index) const;

    /// The linear colour at a point, 0 to kTexelOne a channel, bilinear on two levels with weights
    /// of 8 bits, and mixed between them. level: 0 is the image, 256 its half, and so on; a
    /// fraction mixes. Coordinates from 2^23 on count as 0.
    uvec3 colour_at(Texcoord at, std::uint32_t level) const;

private:
    struct Level {
        std::uint32_t width;
        std::uint32_t height;
        std::size_t first;
    };
    uvec3 bilinear(const Level& level, float u, float v) const;
    void append_half();

    std::vector<Level> levels_;
    std::vector<std::uint32_t> texels_;
    bool clamp_;
};

/// The level at which a texel is as large as a sample that covers this many texels of the image:
/// half their logarithm to the base 2 in 1/256, straight between powers of two. 0 for less than 1.
std::uint32_t level_of_texels(double texels);

/// The textures of a scene's triangles. The spans may be empty: no triangle has a texture.
struct TexturedTriangles {
    std::span<const std::shared_ptr<const Texture>> textures = {};
    /// For each triangle. ids are indices of `textures`, or kNoTexture.
    std::span<const Texcoords> texcoords = {};
    std::span<const std::uint32_t> ids = {};
};

/// A sample that shows a triangle with a texture.
struct TexturedSample {
    std::uint32_t prim;
    float u, v;
    /// In scene space: the triangle's vertices, the ray's direction with 1 along the viewing
    /// direction, the depth along it and the square of the distance between samples at depth 1.
    vec3 corners[3];
    vec3 through;
    float depth;
    double spacing_squared;
};

/// The linear colour of the sample's texture, as Texture::colour_at(), at the level whose texels
/// are as large as the part of the surface that the sample shows.
uvec3 texture_colour(const TexturedTriangles& triangles, const TexturedSample& sample);

}  // namespace mray::cpu
