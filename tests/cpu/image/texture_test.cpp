#include "cpu/image/texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "tests/support/texture_colours.h"

namespace mray::cpu {
namespace {

using namespace test;

constexpr std::uint32_t kTexelOne = 255 * 255;

std::vector<std::uint32_t> noise(std::uint32_t width, std::uint32_t height, unsigned seed = 1) {
    std::mt19937 random(seed);
    std::vector<std::uint32_t> texels(std::size_t{width} * height);
    for (std::uint32_t& texel : texels) texel = static_cast<std::uint32_t>(random());
    return texels;
}

std::uint32_t channel(std::uint32_t texel, int k) { return texel >> (8 * k) & 0xFF; }

uvec3 squares(std::uint32_t texel) {
    const uvec3 c(channel(texel, 0), channel(texel, 1), channel(texel, 2));
    return c * c;
}

std::span<const std::uint32_t> level_of(const Texture& texture, std::size_t index) {
    const Texture::Level& level = texture.levels()[index];
    return texture.texels().subspan(level.first, std::size_t{level.width} * level.height);
}

TEST(Texture, ShowsATexelAtItsCentre) {
    for (const bool clamp : {false, true}) {
        for (const uvec3 size : {uvec3(1, 1, 0), uvec3(4, 2, 0), uvec3(3, 5, 0), uvec3(16, 9, 0)}) {
            const auto texels = noise(size.x, size.y);
            const Texture texture(texels, size.x, size.y, clamp);
            for (std::uint32_t y = 0; y < size.y; ++y) {
                for (std::uint32_t x = 0; x < size.x; ++x) {
                    // v goes upwards, rows downwards; sides of a power of two are exact.
                    const Texcoord at{
                        (static_cast<float>(x) + 0.5f) / static_cast<float>(size.x),
                        1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(size.y)};
                    const uvec3 colour = colour_at(texture, at, 0);
                    const uvec3 expected = squares(texels[y * size.x + x]);
                    const bool is_exact =
                        (size.x & (size.x - 1)) == 0 && (size.y & (size.y - 1)) == 0;
                    // A coordinate that is rounded down is 1/256 of a texel off.
                    const double off = is_exact ? 0 : 2.0 / 256 * kTexelOne + 1;
                    for (int k = 0; k < 3; ++k)
                        EXPECT_NEAR(colour[k], expected[k], off) << x << ' ' << y;
                }
            }
        }
    }
}

TEST(Texture, MixesFourTexelsInLinearLight) {
    const std::vector<std::uint32_t> texels = {0x000000, 0xFFFFFF, 0x0000FF, 0x00FF00};
    const Texture texture(texels, 2, 2, true);
    // A quarter to the right and half down between the centres.
    const uvec3 colour = colour_at(texture, {0.25f + 0.125f, 0.5f}, 0);
    const auto eighths = [](std::uint32_t count) { return (kTexelOne * count + 4) / 8; };
    EXPECT_EQ(colour, uvec3(eighths(4), eighths(2), eighths(1)));
}

TEST(Texture, RepeatsOrClampsBeyondItsImage) {
    const auto texels = noise(8, 4);
    const Texture repeated(texels, 8, 4, false);
    const Texture clamped(texels, 8, 4, true);
    for (float u = -2; u < 3; u += 0.03125f) {
        for (float v = -2; v < 3; v += 0.0625f) {
            EXPECT_EQ(colour_at(repeated, {u, v}, 0),
                      colour_at(repeated, {u - std::floor(u), v - std::floor(v)}, 0));
            EXPECT_EQ(
                colour_at(clamped, {u, v}, 0),
                colour_at(clamped, {std::clamp(u, 0.0f, 1.0f), std::clamp(v, 0.0f, 1.0f)}, 0));
        }
    }
    // Between the last and the first column.
    const uvec3 seam = colour_at(repeated, {0, 1 - 0.125f}, 0);
    const uvec3 ends = squares(texels[0]) + squares(texels[7]);
    for (int k = 0; k < 3; ++k) EXPECT_EQ(seam[k], (ends[k] + 1) / 2);
    EXPECT_EQ(colour_at(clamped, {0, 1 - 0.125f}, 0), squares(texels[0]));
}

TEST(Texture, AnswersForAnyCoordinates) {
    const auto texels = noise(7, 3);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (const bool clamp : {false, true}) {
        const Texture texture(texels, 7, 3, clamp);
        for (const float x :
             {-kInfinity, -1e30f, -8388608.0f, -1e-30f, -0.0f, 1e-45f, 0.99999994f, 1.0f,
              8388607.5f, 3e38f, kInfinity, std::numeric_limits<float>::quiet_NaN()}) {
            for (const std::uint32_t level : {0u, 100u, 256u, 511u, 512u, 0xFFFFFFFFu}) {
                const uvec3 colour = colour_at(texture, {x, x}, level);
                for (int k = 0; k < 3; ++k) EXPECT_LE(colour[k], kTexelOne);
            }
        }
    }
}

TEST(Texture, LevelsAreMeansOfIntensities) {
    for (const uvec3 size :
         {uvec3(8, 8, 0), uvec3(7, 5, 0), uvec3(1, 9, 0), uvec3(6, 1, 0), uvec3(13, 2, 0)}) {
        const auto texels = noise(size.x, size.y, size.x);
        const Texture texture(texels, size.x, size.y, false);
        std::uint32_t width = size.x, height = size.y;
        for (std::size_t i = 1; i < texture.levels().size(); ++i) {
            const auto from = level_of(texture, i - 1);
            const std::uint32_t half_width = std::max(width / 2, 1u);
            const std::uint32_t half_height = std::max(height / 2, 1u);
            const auto to = level_of(texture, i);
            ASSERT_EQ(to.size(), std::size_t{half_width} * half_height);
            // By areas, in floating-point numbers.
            for (std::uint32_t y = 0; y < half_height; ++y) {
                for (std::uint32_t x = 0; x < half_width; ++x) {
                    for (int k = 0; k < 3; ++k) {
                        const double sx = double(width) / half_width;
                        const double sy = double(height) / half_height;
                        double sum = 0;
                        for (std::uint32_t j = 0; j < height; ++j) {
                            for (std::uint32_t l = 0; l < width; ++l) {
                                const double in_x = std::min<double>(l + 1, (x + 1) * sx) -
                                                    std::max<double>(l, x * sx);
                                const double in_y = std::min<double>(j + 1, (y + 1) * sy) -
                                                    std::max<double>(j, y * sy);
                                if (in_x <= 0 || in_y <= 0) continue;
                                const double c = channel(from[j * width + l], k);
                                sum += in_x * in_y * c * c;
                            }
                        }
                        EXPECT_NEAR(channel(to[y * half_width + x], k), std::sqrt(sum / (sx * sy)),
                                    0.51);
                    }
                }
            }
            width = half_width;
            height = half_height;
        }
        EXPECT_EQ(width * height, 1u);
    }
}

TEST(Texture, FractionsOfLevelsMixThem) {
    const auto texels = noise(16, 16);
    const Texture texture(texels, 16, 16, false);
    const Texcoord at{0.4f, 0.3f};
    const uvec3 fine = colour_at(texture, at, 256);
    const uvec3 coarse = colour_at(texture, at, 512);
    EXPECT_EQ(colour_at(texture, at, 256 + 64), (fine * 192u + coarse * 64u + 128u) / 256u);
    // The last level is one texel.
    EXPECT_EQ(colour_at(texture, at, 4 * 256), squares(level_of(texture, 4)[0]));
    EXPECT_EQ(colour_at(texture, at, 4 * 256 + 99), squares(level_of(texture, 4)[0]));
}

TEST(Texture, LevelIsHalfTheLogarithmOfTexels) {
    EXPECT_EQ(level_of_texels(0), 0u);
    EXPECT_EQ(level_of_texels(1), 0u);
    EXPECT_EQ(level_of_texels(std::nan("")), 0u);
    EXPECT_EQ(level_of_texels(4), 256u);
    EXPECT_EQ(level_of_texels(16), 512u);
    EXPECT_EQ(level_of_texels(2), 128u);
    EXPECT_EQ(level_of_texels(3), 192u);  // straight between 2 and 4
    EXPECT_GE(level_of_texels(std::numeric_limits<double>::infinity()), 14u * 256);
}

TEST(Texture, HolesAreWhereTheAlphaBetweenTexelsIsBelowTheCutoff) {
    std::mt19937 random(4);
    std::uniform_real_distribution<float> anywhere(-2, 3);
    std::size_t holes = 0;
    for (const bool clamp : {false, true}) {
        const auto texels = noise(13, 6);
        const auto alpha_of = [&](int x, int y) {
            const auto within = [&](int i, int size) {
                return clamp ? std::clamp(i, 0, size - 1) : (i + size) % size;
            };
            return static_cast<double>(
                texels[static_cast<std::size_t>(within(y, 6) * 13 + within(x, 13))] >> 24);
        };
        for (const float cutoff : {0.25f, 0.5f, 0.8f}) {
            const Texture texture(texels, 13, 6, clamp, cutoff);
            EXPECT_TRUE(texture.has_alpha_test());
            for (int i = 0; i < 5000; ++i) {
                const float u = texture.into_image(anywhere(random));
                const float v = texture.into_image(anywhere(random));
                const double x = std::floor(double{u} * 13 * 256) / 256 - 0.5;
                const double y = std::floor(double{v} * 6 * 256) / 256 - 0.5;
                const int left = static_cast<int>(std::floor(x));
                const int above = static_cast<int>(std::floor(y));
                const double right = x - left, below = y - above;
                const double alpha = (1 - below) * ((1 - right) * alpha_of(left, above) +
                                                    right * alpha_of(left + 1, above)) +
                                     below * ((1 - right) * alpha_of(left, above + 1) +
                                              right * alpha_of(left + 1, above + 1));
                const bool fails_alpha_test = alpha < 255 * static_cast<double>(cutoff);
                // The product with the side is rounded to float.
                if (std::floor(static_cast<double>(u * (13 * 256.0f))) !=
                    std::floor(double{u} * 13 * 256))
                    continue;
                ASSERT_EQ(texture.fails_alpha_test_at(u, v), fails_alpha_test) << u << ' ' << v;
                holes += fails_alpha_test ? 1 : 0;
            }
        }
        EXPECT_FALSE(Texture(texels, 13, 6, clamp).has_alpha_test());
    }
    EXPECT_GT(holes, 5000u);
    EXPECT_LT(holes, 25000u);
    // Half way between two texels the alpha is the cutoff.
    const std::vector<std::uint32_t> sides = {0x00FFFFFF, 0xFFFFFFFF};
    const Texture two(sides, 2, 1, true, 0.5f);
    EXPECT_FALSE(two.fails_alpha_test_at(0.5f, 0));
    EXPECT_TRUE(two.fails_alpha_test_at(0.498f, 0));
    const std::vector<std::uint32_t> half(4, 0x80FFFFFF);
    EXPECT_FALSE(Texture(half, 2, 2, false, 128 / 255.0f - 1e-6f).has_alpha_test());
    EXPECT_TRUE(Texture(half, 2, 2, false, 128 / 255.0f + 1e-6f).has_alpha_test());
}

TEST(TextureColour, TakesTheLevelWhoseTexelsAreAsLargeAsTheSample) {
    const auto texels = noise(64, 64);
    const std::vector<std::shared_ptr<const Texture>> textures = {
        std::make_shared<const Texture>(texels, 64, 64, false)};
    const std::vector<Texcoords> texcoords = {Texcoords{Texcoord{0, 0}, {1, 0}, {0, 1}}};
    const std::vector<std::uint32_t> ids = {0};
    const TexturedTriangles triangles{textures, texcoords, ids};
    TexturedSample sample{.prim = 0,
                          .u = 0.25f,
                          .v = 0.375f,
                          .corners = {{0, 0, -8}, {1, 0, -8}, {0, 1, -8}},
                          .through = {0, 0, -1},
                          .depth = 8,
                          .spacing_squared = 0};
    const Texcoord at{0.25f, 0.375f};
    EXPECT_EQ(texture_colour(triangles, sample), colour_at(*textures[0], at, 0));
    // Samples are 1/8 apart at depth 8, and 32 texels make a side of 1: 4 texels a side.
    for (vec3& corner : sample.corners) corner = {corner.x * 2, corner.y * 2, -8};
    sample.spacing_squared = 1.0 / 64 / 64;
    EXPECT_EQ(texture_colour(triangles, sample), colour_at(*textures[0], at, 2 * 256));
    // A surface that faces the viewing direction has samples of one size everywhere.
    sample.through = {std::sqrt(3.0f), 0, -1};
    EXPECT_EQ(texture_colour(triangles, sample), colour_at(*textures[0], at, 2 * 256));
    sample.depth = 16;
    EXPECT_EQ(texture_colour(triangles, sample), colour_at(*textures[0], at, 3 * 256));
}

}  // namespace
}  // namespace mray::cpu
