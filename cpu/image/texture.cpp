#include "cpu/image/texture.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>

namespace mray::cpu {
namespace {

constexpr std::uint32_t kWeightBits = 8;
constexpr std::uint32_t kWeightOne = 1u << kWeightBits;

std::uint32_t channel(std::uint32_t texel, int k) { return texel >> (8 * k) & 0xFFu; }

/// The texels of a row or column of `size` that texel x of the half as large one covers, and how
/// much of each: all weights are whole numbers with the sum `total`.
struct Taps {
    std::uint32_t first, count;
    std::uint64_t weights[3], total;
};
Taps taps_of(std::uint32_t size, std::uint32_t x) {
    if (size == 1) return {0, 1, {1, 0, 0}, 1};
    if (size % 2 == 0) return {2 * x, 2, {1, 1, 0}, 2};
    // size = 2 m + 1 texels for m, each of which covers 2 + 1/m texels.
    const std::uint32_t m = size / 2;
    return {2 * x, 3, {m - x, m, x + 1}, std::uint64_t{size}};
}

/// The texels that x lies between on a side of `size` texels, and the weight of `high` in 1/256.
struct TexelPair {
    std::uint32_t low, high, weight;
};
TexelPair texel_pair(float x, std::uint32_t size, bool clamp) {
    const int scaled = static_cast<int>(x * static_cast<float>(size * kWeightOne));
    const int centred = scaled - static_cast<int>(kWeightOne / 2);
    const int last = static_cast<int>(size) - 1;
    int low = centred >> kWeightBits;  // rounds downwards
    int high = low + 1;
    if (clamp) {
        low = std::clamp(low, 0, last);
        high = std::min(high, last);
    } else {
        if (low < 0) low = last;
        if (high > last) high = 0;
    }
    return {static_cast<std::uint32_t>(low), static_cast<std::uint32_t>(high),
            static_cast<std::uint32_t>(centred) & (kWeightOne - 1)};
}

/// The texels that a place of a level lies between, and their weights with the sum 2^16.
struct Corners {
    std::size_t texels[4];
    std::uint32_t weights[4];
};
Corners corners_of(float u, float v, std::uint32_t width, std::uint32_t height, bool clamp) {
    const TexelPair x = texel_pair(u, width, clamp);
    const TexelPair y = texel_pair(v, height, clamp);
    const std::size_t upper = std::size_t{y.low} * width;
    const std::size_t lower = std::size_t{y.high} * width;
    const std::uint32_t right = x.weight, left = kWeightOne - right;
    const std::uint32_t below = y.weight, above = kWeightOne - below;
    return {{upper + x.low, upper + x.high, lower + x.low, lower + x.high},
            {left * above, right * above, left * below, right * below}};
}

/// The place on its texture that a triangle shows at (u, v).
Texcoord texcoord_at(const Texcoords& corners, float u, float v) {
    const auto& [a, b, c] = corners;
    const float w = (1.0f - u) - v;
    return {(w * a.u + u * b.u) + v * c.u, (w * a.v + u * b.v) + v * c.v};
}

}  // namespace

Texture::Texture(std::span<const std::uint32_t> texels, std::uint32_t width, std::uint32_t height,
                 bool clamp, float cutoff)
    : clamp_(clamp) {
    levels_.push_back({width, height, 0});
    assert(texels.size() == std::size_t{width} * height && !texels.empty());
    // All levels of a square have a third more.
    texels_.reserve(texels.size() + texels.size() / 3 + 1);
    for (const std::uint32_t texel : texels) texels_.push_back(texel & 0x00FFFFFFu);
    while (levels_.back().width > 1 || levels_.back().height > 1) append_half();
    if (cutoff == 0) return;
    // Exact: the cutoff has 24 bits.
    least_alpha_sum_ =
        static_cast<std::uint32_t>(std::ceil(double{cutoff} * 255 * (kWeightOne * kWeightOne)));
    const auto is_below = [&](std::uint32_t texel) {
        return (texel >> 24) * (kWeightOne * kWeightOne) < least_alpha_sum_;
    };
    if (std::none_of(texels.begin(), texels.end(), is_below)) return;
    alphas_.reserve(texels.size());
    for (const std::uint32_t texel : texels)
        alphas_.push_back(static_cast<std::uint8_t>(texel >> 24));
}

bool Texture::fails_alpha_test_at(float u, float v) const {
    const Level& level = levels_.front();
    const Corners corners = corners_of(u, v, level.width, level.height, clamp_);
    std::uint32_t sum = 0;
    for (int i = 0; i < 4; ++i) sum += corners.weights[i] * alphas_[corners.texels[i]];
    return sum < least_alpha_sum_;
}

float Texture::into_image(float x) const {
    // A float has no fraction from here on; NaN ends here, too.
    constexpr float kMost = 8388608.0f;
    if (!(std::fabs(x) < kMost)) return 0.0f;
    if (clamp_) return std::clamp(x, 0.0f, 1.0f);
    const float fraction = x - static_cast<float>(static_cast<int>(x));
    return fraction < 0.0f ? fraction + 1.0f : fraction;
}

/// Appends a level of half the sides, rounded down: texels are means of what they cover.
void Texture::append_half() {
    const Level from = levels_.back();
    const Level to = {std::max(from.width / 2, 1u), std::max(from.height / 2, 1u), texels_.size()};
    std::vector<Taps> columns;
    for (std::uint32_t x = 0; x < to.width; ++x) columns.push_back(taps_of(from.width, x));
    for (std::uint32_t y = 0; y < to.height; ++y) {
        const Taps rows = taps_of(from.height, y);
        for (const Taps& column : columns) {
            std::uint64_t sums[3] = {};
            for (std::uint32_t j = 0; j < rows.count; ++j) {
                const std::size_t row =
                    from.first + std::size_t{rows.first + j} * from.width + column.first;
                for (std::uint32_t i = 0; i < column.count; ++i) {
                    const std::uint64_t weight = rows.weights[j] * column.weights[i];
                    for (int k = 0; k < 3; ++k) {
                        const std::uint32_t c = channel(texels_[row + i], k);
                        sums[k] += weight * (c * c);
                    }
                }
            }
            const std::uint64_t total = rows.total * column.total;
            std::uint32_t texel = 0;
            for (int k = 0; k < 3; ++k) {
                const std::uint64_t mean = (sums[k] + total / 2) / total;
                const double root = std::sqrt(static_cast<double>(mean));
                texel |= static_cast<std::uint32_t>(root + 0.5) << (8 * k);
            }
            texels_.push_back(texel);
        }
    }
    levels_.push_back(to);
}

/// u and v are within [0, 1], v downwards.
uvec3 Texture::bilinear(const Level& level, float u, float v) const {
    const Corners corners = corners_of(u, v, level.width, level.height, clamp_);
    const std::uint32_t* const texels = texels_.data() + level.first;
    uvec3 colour;
    for (int k = 0; k < 3; ++k) {
        // At most 2^16 * 255^2 + 2^15, which is below 2^32.
        std::uint32_t sum = 1u << (2 * kWeightBits - 1);
        for (int i = 0; i < 4; ++i) {
            const std::uint32_t c = channel(texels[corners.texels[i]], k);
            sum += corners.weights[i] * (c * c);
        }
        colour[k] = sum >> (2 * kWeightBits);
    }
    return colour;
}

uvec3 Texture::colour_within(float u, float v, std::uint32_t level) const {
    const std::size_t last = levels_.size() - 1;
    const std::size_t whole = std::min<std::size_t>(level >> 8, last);
    const std::uint32_t part = whole == last ? 0 : level & 0xFFu;
    const uvec3 fine = bilinear(levels_[whole], u, v);
    if (part == 0) return fine;
    const uvec3 coarse = bilinear(levels_[whole + 1], u, v);
    return (fine * (256u - part) + coarse * part + 128u) >> 8u;
}

std::uint32_t level_of_texels(double texels) {
    if (!(texels > 1.0)) return 0;
    // The exponent and 8 bits of the fraction: the logarithm in 1/256.
    constexpr int kFractionBits = 52;
    const auto bits = std::bit_cast<std::uint64_t>(texels) >> (kFractionBits - 8);
    return static_cast<std::uint32_t>(bits - (std::uint64_t{1023} << 8)) / 2;
}

bool fails_alpha_test(const TexturedTriangles& triangles, const Hit& hit) {
    if (hit.prim_id >= triangles.ids.size() || triangles.ids[hit.prim_id] == kNoTexture)
        return false;
    const Texture& texture = *triangles.textures[triangles.ids[hit.prim_id]];
    if (!texture.has_alpha_test()) return false;
    const Texcoord at = texcoord_at(triangles.texcoords[hit.prim_id], hit.u, hit.v);
    return texture.fails_alpha_test_at(texture.into_image(at.u), texture.into_image(1.0f - at.v));
}

TextureLookup texture_lookup(const TexturedTriangles& triangles, const TexturedSample& sample) {
    const Texture& texture = *triangles.textures[triangles.ids[sample.prim]];
    const auto& [a, b, c] = triangles.texcoords[sample.prim];
    const Texcoord at = texcoord_at(triangles.texcoords[sample.prim], sample.u, sample.v);
    // A sample covers the area depth^2 * spacing^2 / |n . through| of a surface with the unit
    // normal n. The cross product of two edges is n times twice the triangle's area, that of their
    // texture coordinates twice its part of the image.
    const glm::dvec3 first(sample.corners[0]);
    const glm::dvec3 cross =
        glm::cross(glm::dvec3(sample.corners[1]) - first, glm::dvec3(sample.corners[2]) - first);
    const double bu = double{b.u} - double{a.u}, bv = double{b.v} - double{a.v};
    const double cu = double{c.u} - double{a.u}, cv = double{c.v} - double{a.v};
    const double texels =
        std::fabs(bu * cv - bv * cu) * texture.levels()[0].width * texture.levels()[0].height;
    const double covered = double{sample.depth} * double{sample.depth} * sample.spacing_squared;
    const double facing = std::fabs(glm::dot(cross, glm::dvec3(sample.through)));
    return {&texture, texture.into_image(at.u), texture.into_image(1.0f - at.v),
            level_of_texels(texels * covered / facing)};
}

}  // namespace mray::cpu
