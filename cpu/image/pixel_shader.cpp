// Blocks of 4 x 4 pixels from hits to rays and colours.
#include "cpu/image/pixel_shader.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/image/pixel_shader.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/image/leaf_normals-inl.h"
#include "cpu/image/pixel_blocks-inl.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/simd/rounding_bounds.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Rays that differ in their directions and lengths alone.
struct DirectionLanes {
    lanes::Float3 dir;
    FloatVec tfar;
};

HWY_INLINE UintVec load_albedo(const PixelPart& part, const PixelLanes& pixels) {
    return hn::GatherIndex(kUints, part.mesh.topology->albedo.data(), as_int(pixels.prim));
}

/// lanes::colour_of() for intensities that are not negative. Channels are rounded from square
/// roots, which take a third of its time, unless one lies too near to where it rounds up.
HWY_INLINE UintVec colours_of(FloatVec intensity, UintVec albedo) {
    // Numbers up to 255 have no fraction on top of it, and 8 bits of their own.
    constexpr float kBase = 0x1p23f;
    UintVec channels[3];
    FloatVec farthest = zero();
    for (std::uint32_t i = 0; i < 3; ++i) {
        const FloatVec linear = lanes::channel_of(intensity, (albedo >> (8 * i)) & 0xFFu);
        const FloatVec scaled = hn::Sqrt(min(linear, splat(1.0f))) * 255.0f;
        const FloatVec rounded = scaled + kBase;
        farthest = max(farthest, abs(scaled - (rounded - kBase)));
        channels[i] = as_uint(rounded);
    }
    if (HWY_UNLIKELY(!all(farthest < splat(0.5f - kRootMargin))))
        return lanes::colour_of(intensity, albedo);
    return lanes::pack_rgb(channels[0], channels[1], channels[2]);
}

/// camera_ray().dir.
HWY_INLINE lanes::Float3 directions_of(const PixelPart& part, const PixelLanes& pixels) {
    return lanes::canonical_direction(
        lanes::camera_direction(part.params.camera, pixels.x, pixels.y));
}

/// The surfaces that the pixels of a part show, block by block of its strips.
class ShownSurfaces {
public:
    explicit ShownSurfaces(const PixelPart& part) : part_(part) {}

    /// Goes to the first block of a strip.
    void begin(const Tile& strip) {
        if (part_.packet != nullptr) {
            if (leaves_.empty()) leaves_.find(*part_.packet, *part_.mesh.topology);
            return;
        }
        triangles_.clear();
        next_ = 0;
        for_each_block(strip, [&](const PixelBlock& block) HWY_ATTR {
            for (std::uint32_t i = 0; i < kBlockRays; i += kLanes) {
                const PixelLanes pixels = load_pixels(part_, block, i);
                // Where nothing is visible there may be no triangles.
                if (!none(pixels.visible)) triangles_.add(pixels.prim);
            }
        });
        triangles_.load(part_.mesh);
    }

    /// The surfaces of pixels i and following of a block, of which one is visible. After begin()
    /// all such pixels of the strip have to come in order.
    HWY_INLINE lanes::Surface next(const PixelBlock& block, std::uint32_t i,
                                   const PixelLanes& pixels, const lanes::Float3& dir) {
        const lanes::Float3 org(part_.params.camera.org);
        lanes::Float3 normals;
        if (part_.packet != nullptr) {
            const auto x = block.x - static_cast<std::uint32_t>(part_.packet->camera.first_x);
            const auto y = block.y - static_cast<std::uint32_t>(part_.packet->camera.first_y);
            const std::uint32_t ray = camera_packet_ray(x, y) + i;
            leaves_.look_up(part_.packet->candidate + ray, normals, albedos_);
        } else {
            normals = triangles_.normals(next_);
            albedos_ = triangles_.albedos(next_++);
        }
        if (HWY_UNLIKELY(triangles_.has_degenerate() || leaves_.has_degenerate())) {
            lanes::Float3 v[3];
            load_corners(*part_.mesh.topology, part_.mesh.positions, pixels.prim, v);
            return lanes::surface_of(org, dir, pixels.t, v[0], v[1], v[2]);
        }
        return lanes::surface_with(org, dir, pixels.t, normals);
    }

    /// The albedos of the surfaces that next() has returned.
    HWY_INLINE UintVec albedos() const { return albedos_; }

private:
    const PixelPart& part_;
    LeafNormals leaves_;
    ShownTriangles triangles_;
    std::uint32_t next_ = 0;
    UintVec albedos_;
};

/// Writes occlusion and, if the frame has pixels, colours of a part. begin(strip) comes before the
/// blocks of a strip. shade(block, i, behind, occlusion) sets the numbers of occluded rays, 0
/// before, of pixels i and following of a block, and returns their colours; behind: those of the
/// background, or anything if the frame has no pixels.
template <class Begin, class Shade>
HWY_INLINE void shade_part(const PixelPart& part, Begin begin, Shade shade) {
    for_each_strip(part.tile, [&](const Tile& strip) HWY_ATTR {
        begin(strip);
        alignas(64) std::uint32_t behind[kBlockRays];
        for (std::uint32_t i = 0; i < kBlockRays; ++i)
            behind[i] = background(strip.y0 + (i & kRowMask), part.params.height);
        StripRows colour_rows, occlusion_rows;
        for_each_block(strip, [&](const PixelBlock& block) HWY_ATTR {
            alignas(64) std::uint32_t colours[kBlockRays];
            alignas(64) std::uint32_t occlusion[kBlockRays] = {};
            for (std::uint32_t i = 0; i < kBlockRays; i += kLanes)
                store(shade(block, i, load(behind + i), occlusion + i), colours + i);
            occlusion_rows.set(strip, block, occlusion);
            colour_rows.set(strip, block, colours);
        });
        const std::uint32_t width = part.params.width;
        occlusion_rows.write(strip, width, part.frame.occlusion.data());
        if (part.frame.with_pixels) colour_rows.write(strip, width, part.frame.pixels.data());
    });
    hwy::FlushStream();
}

void shade_camera_part(const PixelPart& part) {
    const bool with_pixels = part.frame.with_pixels;
    ShownSurfaces surfaces(part);
    shade_part(
        part,
        [&](const Tile& strip) HWY_ATTR {
            if (with_pixels) surfaces.begin(strip);
        },
        [&](const PixelBlock& block, std::uint32_t i, UintVec behind, std::uint32_t*) HWY_ATTR {
            if (!with_pixels) return behind;
            const PixelLanes pixels = load_pixels(part, block, i);
            if (none(pixels.visible)) return behind;
            const lanes::Float3 dir = directions_of(part, pixels);
            const lanes::Surface s = surfaces.next(block, i, pixels, dir);
            const FloatVec intensity = lanes::lit_intensity(abs(dot3(s.normal, unit(dir))));
            return select(uint_mask(pixels.visible), colours_of(intensity, surfaces.albedos()),
                          behind);
        });
}

HWY_INLINE DirectionLanes shadow_rays(const lanes::Surface& s, const lanes::Float3& light) {
    const lanes::Float3 dir = shadow_direction(s, light);
    return {canonical_direction(dir), lanes::power_of_two_below(largest_component(dir))};
}

ShadowRayCounts make_shadow_rays_of_part(const PixelPart& part, SharedOriginRays* rays,
                                         LitPixels* lit) {
    ShadowRayCounts counts;
    ShownSurfaces surfaces(part);
    const lanes::Float3 light(part.params.light);
    for_each_strip(part.tile, [&](const Tile& strip) HWY_ATTR {
        surfaces.begin(strip);
        for_each_block(strip, [&](const PixelBlock& block) HWY_ATTR {
            const std::uint32_t index = block.ray_index(part) / kBlockRays;
            SharedOriginRays& to = rays[index];
            LitPixels& pixels_lit = lit[index];
            for (std::uint32_t i = 0; i < kBlockRays; i += kLanes) {
                const PixelLanes pixels = load_pixels(part, block, i);
                lanes::Float3 dir(vec3(0.0f));
                FloatVec tfar = splat(-1.0f);
                FloatVec intensity = zero_unless(pixels.visible, splat(kUnlitIntensity));
                if (!none(pixels.visible)) {
                    counts.hits += count(pixels.visible);
                    const lanes::Surface s =
                        surfaces.next(block, i, pixels, directions_of(part, pixels));
                    const Mask traced = pixels.visible & faces_light(s, light);
                    if (part.frame.with_pixels) store(surfaces.albedos(), pixels_lit.albedo + i);
                    if (!none(traced)) {
                        const DirectionLanes ray = shadow_rays(s, light);
                        dir = select(traced, ray.dir, dir);
                        tfar = select(traced, ray.tfar, tfar);
                        if (part.frame.with_pixels) {
                            const FloatVec facing = dot3(s.normal, unit(light - s.point));
                            intensity = zero_unless(pixels.visible,
                                                    lanes::lit_intensity(max(facing, zero())));
                        }
                        counts.rays += count(traced);
                    }
                }
                store(dir.x, to.dir[0] + i);
                store(dir.y, to.dir[1] + i);
                store(dir.z, to.dir[2] + i);
                store(tfar, to.tfar + i);
                store(intensity, pixels_lit.intensity + i);
            }
        });
    });
    return counts;
}

void shade_shadows_of_part(const PixelPart& part, const std::uint8_t* occluded,
                           const LitPixels* lit) {
    const hn::Rebind<std::uint8_t, UintTag> bytes;
    shade_part(
        part, [](const Tile&) HWY_ATTR {},
        [&](const PixelBlock& block, std::uint32_t i, UintVec behind,
            std::uint32_t* occlusion) HWY_ATTR {
            const std::uint32_t index = block.ray_index(part);
            const LitPixels& pixels = lit[index / kBlockRays];
            const FloatVec intensity = load(pixels.intensity + i);
            const Mask visible = intensity > zero();
            const UintVec is_occluded = zero_unless(
                uint_mask(visible), hn::PromoteTo(kUints, hn::LoadU(bytes, occluded + index + i)));
            store(is_occluded, occlusion);
            if (!part.frame.with_pixels || none(visible)) return behind;
            const FloatVec value =
                select(float_mask(is_occluded > 0u), splat(kUnlitIntensity), intensity);
            return select(uint_mask(visible), colours_of(value, load(pixels.albedo + i)), behind);
        });
}

/// ao_ray() of the surfaces that pixels (x, y) show, without the origin.
HWY_INLINE DirectionLanes ao_rays(const lanes::Surface& s, UintVec x, UintVec y,
                                  std::uint32_t sample, float tfar) {
    const lanes::Float3 dir = ao_direction(s, lanes::sphere_point(lanes::ao_number(x, y, sample)));
    return {canonical_direction(dir), tfar * lanes::power_of_two_below(largest_component(dir))};
}

/// The first or the last 16 bytes of a Ray.
struct alignas(16) HalfRay {
    float words[4];
};
static_assert(2 * sizeof(HalfRay) == sizeof(Ray));

/// Writes a ray half by half: one copy of both halves would wait for the stores of each.
HWY_INLINE void write_ray(const HalfRay& start, const HalfRay& end, Ray& ray) {
    auto* const to = reinterpret_cast<std::byte*>(&ray);
    std::memcpy(to, &start, sizeof start);
    std::memcpy(to + sizeof start, &end, sizeof end);
}

void make_camera_rays_of_tile(const ImageParams& params, const Tile& tile, Ray* rays) {
    const Ray any = camera_ray(params.camera, 0, 0);
    const HalfRay start = {{any.org.x, any.org.y, any.org.z, any.tnear}};
    alignas(64) HalfRay ends[kLanes];
    for_each_block(tile, [&](const PixelBlock& block) HWY_ATTR {
        for (std::uint32_t i = 0; i < kBlockRays; i += kLanes) {
            const UintVec lane = hn::Iota(kUints, i);
            const UintVec x = shift_right<kColumnShift>(lane) + splat(block.x);
            const UintVec y = (lane & splat(kRowMask)) + splat(block.y);
            const lanes::Float3 dir =
                lanes::canonical_direction(lanes::camera_direction(params.camera, x, y));
            hn::StoreInterleaved4(dir.x, dir.y, dir.z, splat(any.tfar), kFloats, ends[0].words);
            for (std::size_t k = 0; k < kLanes; ++k) write_ray(start, ends[k], *rays++);
        }
    });
}

void make_ao_rays_of_part(const PixelPart& part, std::vector<Ray>& rays) {
    const std::uint32_t count = part.params.ao_count;
    rays.clear();
    ShownSurfaces surfaces(part);
    for_each_strip(part.tile, [&](const Tile& strip) HWY_ATTR {
        surfaces.begin(strip);
        for_each_block(strip, [&](const PixelBlock& block) HWY_ATTR {
            for (std::uint32_t i = 0; i < kBlockRays; i += kLanes) {
                const PixelLanes pixels = load_pixels(part, block, i);
                const std::uint32_t visible = bits_of(pixels.visible);
                if (visible == 0) continue;
                const lanes::Surface s =
                    surfaces.next(block, i, pixels, directions_of(part, pixels));
                const lanes::Float3 org = off_surface(s, s.size);
                alignas(64) HalfRay starts[kBlockRays], ends[kBlockRays];
                hn::StoreInterleaved4(org.x, org.y, org.z, splat(0.0f), kFloats, starts[0].words);
                const std::size_t begin = rays.size();
                const auto visible_count =
                    static_cast<std::size_t>(hwy::PopCount(std::uint64_t{visible}));
                rays.resize(begin + visible_count * count);
                for (std::uint32_t sample = 0; sample < count; ++sample) {
                    const DirectionLanes ray =
                        ao_rays(s, pixels.x, pixels.y, sample, part.params.ao_tfar);
                    hn::StoreInterleaved4(ray.dir.x, ray.dir.y, ray.dir.z, ray.tfar, kFloats,
                                          ends[0].words);
                    std::size_t at = begin + sample;
                    for (std::uint32_t left = visible; left != 0; left &= left - 1, at += count) {
                        const std::size_t lane = hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
                        write_ray(starts[lane], ends[lane], rays[at]);
                    }
                }
            }
        });
    });
}

void shade_ao_of_part(const PixelPart& part, const std::uint8_t* occluded) {
    const std::uint32_t count = part.params.ao_count;
    const FloatVec per_ray = splat(rcp(static_cast<float>(count)));
    shade_part(
        part, [](const Tile&) HWY_ATTR {},
        [&](const PixelBlock& block, std::uint32_t i, UintVec behind, std::uint32_t* occlusion)
            HWY_ATTR {
                const PixelLanes pixels = load_pixels(part, block, i);
                if (none(pixels.visible)) return behind;
                for (std::uint32_t left = bits_of(pixels.visible); left != 0; left &= left - 1) {
                    std::uint32_t& sum = occlusion[hwy::Num0BitsBelowLS1Bit_Nonzero32(left)];
                    for (std::uint32_t sample = 0; sample < count; ++sample) sum += *occluded++;
                }
                if (!part.frame.with_pixels) return behind;
                const UintVec open = splat(count) - load(occlusion);
                return select(
                    uint_mask(pixels.visible),
                    colours_of(lanes::to_float(open) * per_ray, load_albedo(part, pixels)), behind);
            });
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {
namespace {

HWY_EXPORT(shade_camera_part);
HWY_EXPORT(make_camera_rays_of_tile);
HWY_EXPORT(make_shadow_rays_of_part);
HWY_EXPORT(shade_shadows_of_part);
HWY_EXPORT(make_ao_rays_of_part);
HWY_EXPORT(shade_ao_of_part);

}  // namespace

PixelShader::PixelShader(SimdTarget target)
    : make_camera_rays(SIMD_FUNCTION(make_camera_rays_of_tile, target)),
      shade_camera(SIMD_FUNCTION(shade_camera_part, target)),
      make_shadow_rays(SIMD_FUNCTION(make_shadow_rays_of_part, target)),
      shade_shadows(SIMD_FUNCTION(shade_shadows_of_part, target)),
      make_ao_rays(SIMD_FUNCTION(make_ao_rays_of_part, target)),
      shade_ao(SIMD_FUNCTION(shade_ao_of_part, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
