// Textures: images that triangles show.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::cpu {

/// An image with its smaller levels, each half as wide and high (L. Williams. Pyramidal
/// parametrics. 1983). A texel's 8-bit channels are taken as square roots of linear intensities, as
/// those of images are. Its alpha makes holes alone. All arithmetic is of whole numbers but for the
/// rounding of coordinates, which single floating-point operations do.
class Texture {
public:
    /// `texels`: width * height of them, row by row from the top, R in bits 0-7, G in 8-15, B in
    /// 16-23; neither side is 0 or above 2^14. Outside of the image its border is repeated (clamp),
    /// or the image. Alpha, in bits 24-31 of the image's texels, makes a hole where it is below
    /// `cutoff`, from 0 to 1 (255); 0: nowhere. O(texels).
    Texture(std::span<const std::uint32_t> texels, std::uint32_t width, std::uint32_t height,
            bool clamp, float cutoff = 0);

    struct Level {
        std::uint32_t width, height;
        std::size_t first;
    };
    std::span<const Level> levels() const { return levels_; }
    /// The texels of all levels, packed as in the image, without alpha.
    std::span<const std::uint32_t> texels() const { return texels_; }

    /// The coordinate within the image, 0 to 1, that a coordinate stands for. From 2^23 on it is 0.
    float into_image(float x) const;

    /// The linear colour at a point of the image, 0 to 255^2 a channel, bilinear on two levels
    /// with weights of 8 bits, and mixed between them. u, v: from the left and from the top, 0
    /// to 1. level: 0 is the image, 256 its half, and so on; a fraction mixes.
    uvec3 colour_within(float u, float v, std::uint32_t level) const;

    bool has_alpha_test() const { return !alphas_.empty(); }
    /// Whether a point of the image is in a hole: by its alpha on level 0, bilinear with weights of
    /// 8 bits. u, v: as in colour_within().
    bool fails_alpha_test_at(float u, float v) const;

private:
    uvec3 bilinear(const Level& level, float u, float v) const;
    void append_half();

    std::vector<Level> levels_;
    std::vector<std::uint32_t> texels_;
    bool clamp_;
    /// The alpha of each texel of level 0; empty without holes.
    std::vector<std::uint8_t> alphas_;
    /// Sums of four alphas, whose weights add up to 2^16, are holes below this.
    std::uint32_t least_alpha_sum_ = 0;
};

/// The level at which a texel is as large as a sample that covers this many texels of the image:
/// half their logarithm to the base 2 in 1/256, straight between powers of two. 0 for less than 1.
std::uint32_t level_of_texels(double texels);

/// The textures of a scene's triangles. The spans may be empty: no triangle has a texture.
struct TexturedTriangles {
    std::span<const std::shared_ptr<const Texture>> textures = {};
    /// One entry a triangle; ids are indices of `textures`, or kNoTexture.
    std::span<const Texcoords> texcoords = {};
    std::span<const std::uint32_t> ids = {};
};

/// Whether a hit is in a hole of its triangle's texture; not without a texture or a hit.
bool fails_alpha_test(const TexturedTriangles& triangles, const Hit& hit);

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

/// Arguments of Texture::colour_within().
struct TextureLookup {
    const Texture* texture;
    float u, v;
    std::uint32_t level;
};

/// Where a sample shows its triangle's texture, at the level whose texels are as large as it.
TextureLookup texture_lookup(const TexturedTriangles& triangles, const TexturedSample& sample);

}  // namespace mray::cpu
