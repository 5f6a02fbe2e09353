// Colours of textures, one sample a lane.
#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/base/aligned_vector.h"
#include "cpu/image/lit_shader.h"
#include "cpu/image/texture.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR
inline constexpr hn::FixedTag<float, 4> kFourFloats;
inline constexpr hn::FixedTag<std::int32_t, 4> kFourInts;
inline constexpr hn::FixedTag<std::uint32_t, 4> kFourUints;
using FourUints = hn::Vec<decltype(kFourUints)>;

/// The channels at a place of a level: columns x[0], x[2] of rows x[1], x[3], with their weights.
HWY_INLINE FourUints bilinear_channels(const std::uint32_t* texels, std::uint32_t width,
                                       const std::uint32_t x[4], std::uint32_t right,
                                       std::uint32_t below) {
    const std::uint32_t* const upper = texels + std::size_t{x[1]} * width;
    const std::uint32_t* const lower = texels + std::size_t{x[3]} * width;
    FourUints sum = hn::Set(kFourUints, 1u << 15);
    const auto add = [&](const std::uint32_t* texel, std::uint32_t weight) HWY_ATTR {
        const hn::FixedTag<std::uint8_t, 4> bytes;
        const FourUints c = hn::PromoteTo(
            kFourUints, hn::LoadU(bytes, reinterpret_cast<const std::uint8_t*>(texel)));
        sum = sum + c * c * hn::Set(kFourUints, weight);
    };
    add(upper + x[0], (256 - right) * (256 - below));
    add(upper + x[2], right * (256 - below));
    add(lower + x[0], (256 - right) * below);
    add(lower + x[2], right * below);
    return hn::ShiftRight<16>(sum);
}

/// Texture::colour_within() with a channel a lane; writes four floats.
HWY_INLINE void store_colour(const TexturePlace& place, float* to) {
    const Texture& texture = *place.texture;
    const std::size_t last_level = texture.levels().size() - 1;
    const std::size_t whole = std::min<std::size_t>(place.level >> 8, last_level);
    const std::uint32_t part = whole == last_level ? 0 : place.level & 0xFFu;
    const Texture::Level& level = texture.levels()[whole];

    // u and v on the level, then on the next one.
    alignas(16) const float at[4] = {place.u, place.v, place.u, place.v};
    const auto sides = hn::Load(kFourInts, level.sides);
    const auto last = sides - hn::Set(kFourInts, 1);
    const auto scaled =
        hn::Load(kFourFloats, at) * hn::ConvertTo(kFourFloats, hn::ShiftLeft<8>(sides));
    const auto centred = hn::ConvertTo(kFourInts, scaled) - hn::Set(kFourInts, 128);
    auto low = hn::ShiftRight<8>(centred);
    auto high = low + hn::Set(kFourInts, 1);
    if (texture.clamps()) {
        low = hn::Min(hn::Max(low, hn::Zero(kFourInts)), last);
        high = hn::Min(high, last);
    } else {
        low = hn::IfThenElse(low < hn::Zero(kFourInts), last, low);
        high = hn::IfThenZeroElse(high > last, high);
    }
    alignas(16) std::int32_t lows[4], highs[4], weights[4];
    hn::Store(low, kFourInts, lows);
    hn::Store(high, kFourInts, highs);
    hn::Store(hn::And(centred, hn::Set(kFourInts, 255)), kFourInts, weights);
    const auto channels = [&](const Texture::Level& of, std::size_t i) HWY_ATTR {
        const auto whole_of = [](std::int32_t x) { return static_cast<std::uint32_t>(x); };
        const std::uint32_t x[4] = {whole_of(lows[i]), whole_of(lows[i + 1]), whole_of(highs[i]),
                                    whole_of(highs[i + 1])};
        return bilinear_channels(texture.texels().data() + of.first, of.width(), x,
                                 whole_of(weights[i]), whole_of(weights[i + 1]));
    };
    FourUints colour = channels(level, 0);
    if (part != 0) {
        const FourUints coarse = channels(texture.levels()[whole + 1], 2);
        colour = hn::ShiftRight<8>(colour * hn::Set(kFourUints, 256 - part) +
                                   coarse * hn::Set(kFourUints, part) + hn::Set(kFourUints, 128));
    }
    hn::Store(hn::ConvertTo(kFourFloats, hn::BitCast(kFourInts, colour)), kFourFloats, to);
}
#else
HWY_INLINE void store_colour(const TexturePlace& place, float* to) {
    const uvec3 colour = place.texture->colour_within(place.u, place.v, place.level);
    for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(colour[k]);
}
#endif

/// Returns the part of the light that triangles with these albedos reflect: the colours, multiplied
/// by the texture where they have one. through, depth: as in TexturedSample. A sample without a hit
/// has a depth of 0 or less, and its colour is unspecified.
HWY_INLINE lanes::Float3 base_colours(const LitSamples& s, UintVec albedo, UintVec prim, FloatVec u,
                                      FloatVec v, const lanes::Float3& through, FloatVec depth) {
    const lanes::Float3 base = lanes::albedo_colour(albedo);
    const auto is_textured = (albedo & kTexturedBit) == splat(kTexturedBit);
    if (HWY_LIKELY(none(is_textured))) return base;
    alignas(64) std::uint32_t bits[kLanes], prims[kLanes];
    alignas(64) float at_u[kLanes], at_v[kLanes], depths[kLanes], dirs[3][kLanes];
    alignas(64) float colours[3][kLanes] = {};
    store(albedo, bits);
    store(prim, prims);
    store(u, at_u);
    store(v, at_v);
    store(depth, depths);
    store(through.x, dirs[0]);
    store(through.y, dirs[1]);
    store(through.z, dirs[2]);
    const vec3 du = s.params.camera.du;
    const double spacing_squared = double{du.x} * du.x + double{du.y} * du.y + double{du.z} * du.z;
    // Texels lie anywhere in memory, and samples differ in textures and levels, so each sample
    // takes lanes of its own: four coordinates, then four channels.
    for (std::size_t l = 0; l < kLanes; ++l) {
        if ((bits[l] & kTexturedBit) == 0 || !(depths[l] > 0.0f)) continue;
        const uvec3 t = s.topology.triangles[prims[l]];
        alignas(16) float colour[4];
        store_colour(texture_place(s.textures, {.prim = prims[l],
                                                .u = at_u[l],
                                                .v = at_v[l],
                                                .corners = {s.positions[t.x], s.positions[t.y],
                                                            s.positions[t.z]},
                                                .through = {dirs[0][l], dirs[1][l], dirs[2][l]},
                                                .depth = depths[l],
                                                .spacing_squared = spacing_squared}),
                     colour);
        for (int k = 0; k < 3; ++k) colours[k][l] = colour[k];
    }
    const lanes::Float3 texture(load(colours[0]), load(colours[1]), load(colours[2]));
    return select(float_mask(is_textured), lanes::textured_colour(base, texture), base);
}

// From the colours of samples to those of pixels.

/// The squares of 8-bit channels, which are linear intensities, summed over the samples of pixels.
class PixelSums {
public:
    PixelSums(std::size_t width, std::uint32_t side) : side_(side) {
        for (auto& plane : sums_) plane.resize((width + kLanes - 1) / kLanes * kLanes + 2 * kLanes);
    }

    void clear() {
        for (auto& plane : sums_) std::fill(plane.begin(), plane.end(), 0u);
    }

    void add(const std::uint32_t* colours, std::size_t width) {
        for (std::size_t x = 0; x < width; x += kLanes) {
            const UintVec colour = load_unaligned(colours + x);
            for (std::uint32_t k = 0; k < 3; ++k) {
                const UintVec channel = (colour >> (8 * k)) & 0xFFu;
                std::uint32_t* const at = sums_[k].data() + x;
                store_unaligned(load_unaligned(at) + channel * channel, at);
            }
        }
    }

    /// Writes the mean colours of `width` pixels.
    void write(std::size_t width, std::uint32_t* pixels) {
        for (std::uint32_t pairs = side_; pairs > 1; pairs /= 2) {
            const std::size_t count = width * (pairs / 2);
            for (auto& plane : sums_) {
                std::uint32_t* const at = plane.data();
                for (std::size_t x = 0; x < count; x += kLanes) {
                    UintVec even, odd;
                    hn::LoadInterleaved2(kUints, at + 2 * x, even, odd);
                    store_unaligned(even + odd, at + x);
                }
            }
        }
        const float share = 1.0f / static_cast<float>(side_ * side_);
        for (std::size_t x = 0; x < width; x += kLanes) {
            UintVec channels[3];
            for (std::uint32_t k = 0; k < 3; ++k) {
                channels[k] = lanes::root_of_mean(
                    lanes::to_float(load_unaligned(sums_[k].data() + x)) * share);
            }
            const UintVec colour = lanes::pack_rgb(channels[0], channels[1], channels[2]);
            if (width - x >= kLanes) {
                store_unaligned(colour, pixels + x);
            } else {
                alignas(64) std::uint32_t last[kLanes];
                store(colour, last);
                std::copy_n(last, width - x, pixels + x);
            }
        }
    }

private:
    std::uint32_t side_;
    AlignedVector<std::uint32_t> sums_[3];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
