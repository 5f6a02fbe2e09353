// Blocks of 4 x 4 pixels: their hits, the surfaces that these show, rays from there, and colours.
#include "cpu/image/pixel_shader.h"

#include <hwy/cache_control.h>

#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/image/pixel_shader.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "cpu/image/triangle_corners-inl.h"
#include "cpu/packet/camera_candidates-inl.h"
#include "cpu/simd/rounding_bounds.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Blocks

/// A block's pixels are in the order of the rays of a light packet: column by column.
constexpr std::uint32_t kColumnShift = 2;
constexpr std::uint32_t kRowMask = kBlockSide - 1;
static_assert(kBlockSide == 1u << kColumnShift);

struct PixelLanes {
    UintVec x, y;
    /// Whether the pixel is in the region and has a hit.
    Mask visible;
    /// prim is 0 and t undefined where the pixel is not visible.
    UintVec prim;
    FloatVec t;
};

/// A block of a region, of which only the first columns and rows may be in the region.
struct PixelBlock {
    std::uint32_t x, y;
    std::uint32_t columns, rows;

    /// The index of the block's first pixel in a light packet.
    std::uint32_t ray_index(const ImageRegion& region) const {
        return light_packet_ray(x - region.tile.x0, y - region.tile.y0);
    }
};

constexpr std::uint32_t kStripSide = 64;

template <class Visit>
HWY_INLINE void for_each_block(const Tile& tile, Visit visit) {
    for (std::uint32_t y = tile.y0; y < tile.y1; y += kBlockSide) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += kBlockSide) {
            visit(PixelBlock{x, y, std::min(kBlockSide, tile.x1 - x),
                             std::min(kBlockSide, tile.y1 - y)});
        }
    }
}

/// Loads t and prim_id of the pixels of a block in these columns and rows, one a lane.
HWY_INLINE void load_hits(const ImageRegion& region, const PixelBlock& block, std::uint32_t first,
                          UintVec column, UintVec row, FloatVec& t, UintVec& prim) {
    static_assert(sizeof(Hit) == 4 * sizeof(float));
    const float* const hits =
        &region.frame.hits[std::size_t{block.y} * region.params.width + block.x].t;
#if HWY_TARGET != HWY_SCALAR
    if (HWY_LIKELY(block.columns == kBlockSide && block.rows == kBlockSide)) {
        FloatVec in[4], words[4];
        for (std::size_t j = 0; j < 4; ++j)
            in[j] = load_unaligned(hits + 4 * (j * region.params.width + first / kBlockSide));
        transpose_fours(kFloats, in, words);
        t = words[0];
        prim = as_uint(words[3]);
        return;
    }
#else
    (void)first;
#endif
    const UintVec pixel = row * splat(region.params.width) + column;
    const auto at = as_int(shift_left<2>(pixel));
    t = hn::GatherIndex(kFloats, hits, at);
    prim = as_uint(hn::GatherIndex(kFloats, hits, at + splat(3)));
}

HWY_INLINE PixelLanes load_pixels(const ImageRegion& region, const PixelBlock& block,
                                  std::uint32_t first) {
    const UintVec lane = hn::Iota(kUints, first);
    const UintVec column = shift_right<kColumnShift>(lane);
    const UintVec row = lane & splat(kRowMask);
    PixelLanes pixels;
    pixels.x = column + splat(block.x);
    pixels.y = row + splat(block.y);
    // Pixels outside the region are read from its last column or row.
    const UintVec in_column = min(column, splat(block.columns - 1));
    const UintVec in_row = min(row, splat(block.rows - 1));
    UintVec prim;
    load_hits(region, block, first, in_column, in_row, pixels.t, prim);
    const auto is_there = (in_column == column) & (in_row == row);
    const auto is_visible = is_there & (prim != splat(kNoPrim));
    pixels.visible = float_mask(is_visible);
    pixels.prim = zero_unless(is_visible, prim);
    return pixels;
}

class StripRows {
public:
    /// Sets the values of a block, which come column by column.
    HWY_INLINE void set(const Tile& strip, const PixelBlock& block, const std::uint32_t* from) {
        std::uint32_t* const to = rows_[0] + (block.x - strip.x0);
#if HWY_TARGET != HWY_SCALAR
        const hn::CappedTag<std::uint32_t, kBlockSide> four;
        hn::Vec<decltype(four)> columns[kBlockSide], rows[kBlockSide];
        for (std::uint32_t i = 0; i < kBlockSide; ++i)
            columns[i] = hn::Load(four, from + i * kBlockSide);
        transpose_fours(four, columns, rows);
        for (std::uint32_t i = 0; i < kBlockSide; ++i)
            hn::Store(rows[i], four, to + i * kStripSide);
#else
        for (std::uint32_t i = 0; i < kBlockRays; ++i)
            to[(i & kRowMask) * kStripSide + (i >> kColumnShift)] = from[i];
#endif
    }

    /// Writes them to an image. Whole cache lines go past the caches, so that they are not read
    /// before they are overwritten (lab/notes/cpu_tracer.md).
    void write(const Tile& strip, std::uint32_t width, std::uint32_t* image) const {
        std::uint32_t* to = image + std::size_t{strip.y0} * width + strip.x0;
        const std::uint32_t count = strip.x1 - strip.x0;
        for (std::uint32_t i = 0; i < strip.y1 - strip.y0; ++i, to += width) {
            const bool is_aligned = reinterpret_cast<std::uintptr_t>(to) % kCacheLine == 0;
            if (!is_aligned || count % kLanes != 0) {
                std::copy_n(rows_[i], count, to);
                continue;
            }
            for (std::uint32_t x = 0; x < count; x += kLanes)
                hn::Stream(hn::Load(kUints, rows_[i] + x), kUints, to + x);
        }
    }

private:
    alignas(kCacheLine) std::uint32_t rows_[kBlockSide][kStripSide];
};

// ---- Surfaces

/// The normals and albedos of what a camera packet shows, from the leaves that its rays hit, which
/// are still in the caches.
class LeafNormals {
public:
    void find(const CameraPacket& packet, const Topology& topology) {
        has_degenerate_ = false;
        leaves_.resize(packet.hit_leaves.size());
        for (std::size_t i = 0; i < leaves_.size(); ++i)
            find(*packet.hit_leaves[i].leaf, topology, leaves_[i]);
    }

    /// True if a triangle has two parallel edges, so that its normal is undefined.
    bool has_degenerate() const { return has_degenerate_; }

    /// The unit normals, on the triangles' own side, of as many candidates as there are lanes, at
    /// least one, and their albedos. Lanes without a candidate are undefined.
    HWY_INLINE void look_up(const std::uint32_t* indices, lanes::Float3& normals,
                            UintVec& albedos) const {
        const UintVec candidates = load(indices);
        const auto places = hn::IndicesFromVec(kFloats, candidates & splat(kChunkTriangles - 1));
        const auto at = [&](const float* values)
                            HWY_ATTR { return hn::TableLookupLanes(load(values), places); };
        const auto look_up_chunk = [&](std::uint32_t chunk, Mask own) HWY_ATTR {
            const LeafValues& leaf = leaves_[triangle_leaf(chunk)];
            const std::uint32_t first = triangle_slot(chunk);
            const lanes::Float3 n(at(leaf.normal[0] + first), at(leaf.normal[1] + first),
                                  at(leaf.normal[2] + first));
            normals = select(own, n, normals);
            albedos = select(uint_mask(own), as_uint(at(leaf.albedo + first)), albedos);
        };
        const Candidates found = find_candidates(indices);
        look_up_chunk(found.chunk, mask_of(~0u));
        for (std::uint32_t others = found.others; others != 0;) {
            const std::uint32_t chunk = chunk_of(indices[first_bit(others)]);
            const Mask own = candidates_in_chunk(candidates, chunk);
            look_up_chunk(chunk, own);
            others &= ~bits_of(own);
        }
    }

private:
    struct alignas(kCacheLine) LeafValues {
        PerTriangle<float> normal[3];
        PerTriangle<float> albedo;  // bits
    };

    void find(const Leaf& leaf, const Topology& topology, LeafValues& out) {
        const LeafColumns columns(leaf, [](FloatVec v, int) HWY_ATTR { return v; });
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        for (std::size_t l = 0; l < std::size(out.albedo); l += kLanes) {
            FloatVec at_corners[3][3];
            for (int axis = 0; axis < 3; ++axis)
                gather_corners(columns.values[axis], load(columns.corners + l), at_corners[axis]);
            const auto corner = [&](int k) HWY_ATTR {
                return lanes::Float3(at_corners[0][k], at_corners[1][k], at_corners[2][k]);
            };
            const lanes::Float3 across = cross3(corner(1) - corner(0), corner(2) - corner(0));
            store3(unit(across), out.normal, l);
            const std::uint32_t used = ((1u << count) - 1) >> l & kLaneBits;
            has_degenerate_ |= (used & ~bits_of(largest_component(across) > zero())) != 0;
        }
        for (std::uint32_t i = 0; i < count; ++i)
            out.albedo[i] = std::bit_cast<float>(topology.albedo[leaf.prim_id[i]]);
    }

    AlignedVector<LeafValues> leaves_;
    bool has_degenerate_ = false;
};

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

HWY_INLINE lanes::Float3 directions_of(const ImageRegion& region, const PixelLanes& pixels) {
    return lanes::canonical_direction(
        lanes::camera_direction(region.params.camera, pixels.x, pixels.y));
}

class ShownSurfaces {
public:
    explicit ShownSurfaces(const ImageRegion& region, bool is_used = true) : region_(region) {
        if (is_used && region.packet != nullptr)
            leaves_.find(*region.packet, *region.mesh.topology);
    }

    /// The surfaces of pixels i and following of a block, of which one is visible.
    HWY_INLINE lanes::Surface at(const PixelBlock& block, std::uint32_t i, const PixelLanes& pixels,
                                 const lanes::Float3& dir) {
        const lanes::Float3 org(region_.params.camera.org);
        const Topology& topology = *region_.mesh.topology;
        if (region_.packet != nullptr) {
            const CameraPacket& packet = *region_.packet;
            const std::uint32_t ray =
                camera_packet_ray(block.x - packet.first_x, block.y - packet.first_y) + i;
            lanes::Float3 normals;
            leaves_.look_up(packet.candidate + ray, normals, albedos_);
            if (HWY_LIKELY(!leaves_.has_degenerate()))
                return lanes::surface_with(org, dir, pixels.t, normals);
        } else {
            albedos_ = hn::GatherIndex(kUints, topology.albedo.data(), as_int(pixels.prim));
        }
        lanes::Float3 v[3];
        load_corners(topology, region_.mesh.positions, pixels.prim, v);
        return lanes::surface_of(org, dir, pixels.t, v[0], v[1], v[2]);
    }

    /// The albedos that the last call of at() found.
    HWY_INLINE UintVec albedos() const { return albedos_; }

private:
    const ImageRegion& region_;
    LeafNormals leaves_;
    UintVec albedos_;
};

/// Writes occlusion and, if the frame has pixels, colours of a region. shade(block, i, behind,
/// occlusion) sets the numbers of occluded rays, 0 before, of pixels i and following of a block,
/// and returns their colours; behind: those of the background.
template <class Shade>
HWY_INLINE void shade_region(const ImageRegion& region, Shade shade) {
    const Tile& tile = region.tile;
    Tile strip;
    for (strip.y0 = tile.y0; strip.y0 < tile.y1; strip.y0 += kBlockSide) {
        strip.y1 = std::min(strip.y0 + kBlockSide, tile.y1);
        for (strip.x0 = tile.x0; strip.x0 < tile.x1; strip.x0 += kStripSide) {
            strip.x1 = std::min(strip.x0 + kStripSide, tile.x1);
            alignas(64) std::uint32_t behind[kBlockRays];
            for (std::uint32_t i = 0; i < kBlockRays; ++i)
                behind[i] = background(strip.y0 + (i & kRowMask), region.params.height);
            StripRows colour_rows, occlusion_rows;
            for_each_block(strip, [&](const PixelBlock& block) HWY_ATTR {
                alignas(64) std::uint32_t colours[kBlockRays];
                alignas(64) std::uint32_t occlusion[kBlockRays] = {};
                for (std::uint32_t i = 0; i < kBlockRays; i += kLanes)
                    store(shade(block, i, load(behind + i), occlusion + i), colours + i);
                occlusion_rows.set(strip, block, occlusion);
                colour_rows.set(strip, block, colours);
            });
            const std::uint32_t width = region.params.width;
            occlusion_rows.write(strip, width, region.frame.occlusion.data());
            if (region.frame.with_pixels)
                colour_rows.write(strip, width, region.frame.pixels.data());
        }
    }
    hwy::FlushStream();
}

void shade_camera_region(const ImageRegion& region) {
    const bool with_pixels = region.frame.with_pixels;
    ShownSurfaces surfaces(region, with_pixels);
    shade_region(region, [&](const PixelBlock& block, std::uint32_t i, UintVec behind,
                             std::uint32_t*) HWY_ATTR {
        if (!with_pixels) return behind;
        const PixelLanes pixels = load_pixels(region, block, i);
        if (none(pixels.visible)) return behind;
        const lanes::Float3 dir = directions_of(region, pixels);
        const lanes::Surface s = surfaces.at(block, i, pixels, dir);
        const FloatVec intensity = lanes::lit_intensity(abs(dot3(s.normal, unit(dir))));
        return select(uint_mask(pixels.visible), colours_of(intensity, surfaces.albedos()), behind);
    });
}

ShadowRayCounts make_shadow_rays_of_region(const ImageRegion& region, SharedOriginRays* rays,
                                           LitPixels* lit) {
    ShadowRayCounts counts;
    ShownSurfaces surfaces(region);
    const lanes::Float3 light(region.params.light);
    for_each_block(region.tile, [&](const PixelBlock& block) HWY_ATTR {
        const std::uint32_t index = block.ray_index(region) / kBlockRays;
        SharedOriginRays& to = rays[index];
        LitPixels& pixels_lit = lit[index];
        for (std::uint32_t i = 0; i < kBlockRays; i += kLanes) {
            const PixelLanes pixels = load_pixels(region, block, i);
            lanes::Float3 dir(vec3(0.0f));
            FloatVec tfar = splat(-1.0f);
            FloatVec intensity = zero_unless(pixels.visible, splat(kUnlitIntensity));
            if (!none(pixels.visible)) {
                counts.hits += count(pixels.visible);
                const lanes::Surface s =
                    surfaces.at(block, i, pixels, directions_of(region, pixels));
                const Mask traced = pixels.visible & faces_light(s, light);
                if (region.frame.with_pixels) store(surfaces.albedos(), pixels_lit.albedo + i);
                if (!none(traced)) {
                    const lanes::Float3 ray = shadow_direction(s, light);
                    dir = select(traced, canonical_direction(ray), dir);
                    tfar = select(traced, lanes::power_of_two_below(largest_component(ray)), tfar);
                    if (region.frame.with_pixels) {
                        const FloatVec facing = dot3(s.normal, unit(light - s.point));
                        intensity =
                            zero_unless(pixels.visible, lanes::lit_intensity(max(facing, zero())));
                    }
                    counts.rays += count(traced);
                }
            }
            store3(dir, to.dir, i);
            store(tfar, to.tfar + i);
            store(intensity, pixels_lit.intensity + i);
        }
    });
    return counts;
}

void shade_shadows_of_region(const ImageRegion& region, const std::uint8_t* occluded,
                             const LitPixels* lit) {
    const hn::Rebind<std::uint8_t, UintTag> bytes;
    shade_region(region, [&](const PixelBlock& block, std::uint32_t i, UintVec behind,
                             std::uint32_t* occlusion) HWY_ATTR {
        const std::uint32_t index = block.ray_index(region);
        const LitPixels& pixels = lit[index / kBlockRays];
        const FloatVec intensity = load(pixels.intensity + i);
        const Mask visible = intensity > zero();
        const UintVec is_occluded = zero_unless(
            uint_mask(visible), hn::PromoteTo(kUints, hn::LoadU(bytes, occluded + index + i)));
        store(is_occluded, occlusion);
        if (!region.frame.with_pixels || none(visible)) return behind;
        const FloatVec value =
            select(float_mask(is_occluded > 0u), splat(kUnlitIntensity), intensity);
        return select(uint_mask(visible), colours_of(value, load(pixels.albedo + i)), behind);
    });
}

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

void make_ao_rays_of_region(const ImageRegion& region, std::vector<Ray>& rays) {
    const std::uint32_t count = region.params.ao_count;
    rays.clear();
    ShownSurfaces surfaces(region);
    for_each_block(region.tile, [&](const PixelBlock& block) HWY_ATTR {
        for (std::uint32_t i = 0; i < kBlockRays; i += kLanes) {
            const PixelLanes pixels = load_pixels(region, block, i);
            const std::uint32_t visible = bits_of(pixels.visible);
            if (visible == 0) continue;
            const lanes::Surface s = surfaces.at(block, i, pixels, directions_of(region, pixels));
            const lanes::Float3 org = off_surface(s, s.size);
            alignas(64) HalfRay starts[kBlockRays], ends[kBlockRays];
            hn::StoreInterleaved4(org.x, org.y, org.z, splat(0.0f), kFloats, starts[0].words);
            const std::size_t begin = rays.size();
            rays.resize(begin + hwy::PopCount(std::uint64_t{visible}) * count);
            for (std::uint32_t sample = 0; sample < count; ++sample) {
                // As ao_ray().
                const UintVec number = lanes::ao_number(pixels.x, pixels.y, sample);
                const lanes::Float3 ray = ao_direction(s, lanes::sphere_point(number));
                const lanes::Float3 dir = canonical_direction(ray);
                const FloatVec tfar =
                    region.params.ao_tfar * lanes::power_of_two_below(largest_component(ray));
                hn::StoreInterleaved4(dir.x, dir.y, dir.z, tfar, kFloats, ends[0].words);
                std::size_t at = begin + sample;
                for (std::uint32_t left = visible; left != 0; left &= left - 1, at += count) {
                    const std::size_t lane = first_bit(left);
                    write_ray(starts[lane], ends[lane], rays[at]);
                }
            }
        }
    });
}

void shade_ao_of_region(const ImageRegion& region, const std::uint8_t* occluded) {
    const std::uint32_t count = region.params.ao_count;
    const FloatVec per_ray = splat(rcp(static_cast<float>(count)));
    shade_region(region, [&](const PixelBlock& block, std::uint32_t i, UintVec behind,
                             std::uint32_t* occlusion) HWY_ATTR {
        const PixelLanes pixels = load_pixels(region, block, i);
        if (none(pixels.visible)) return behind;
        for (std::uint32_t left = bits_of(pixels.visible); left != 0; left &= left - 1) {
            std::uint32_t& sum = occlusion[first_bit(left)];
            for (std::uint32_t sample = 0; sample < count; ++sample) sum += *occluded++;
        }
        if (!region.frame.with_pixels) return behind;
        const UintVec open = splat(count) - load(occlusion);
        const UintVec albedo =
            hn::GatherIndex(kUints, region.mesh.topology->albedo.data(), as_int(pixels.prim));
        return select(uint_mask(pixels.visible),
                      colours_of(lanes::to_float(open) * per_ray, albedo), behind);
    });
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(shade_camera_region);
HWY_EXPORT(make_camera_rays_of_tile);
HWY_EXPORT(make_shadow_rays_of_region);
HWY_EXPORT(shade_shadows_of_region);
HWY_EXPORT(make_ao_rays_of_region);
HWY_EXPORT(shade_ao_of_region);

PixelShader::PixelShader(SimdTarget target)
    : make_camera_rays(SIMD_FUNCTION(make_camera_rays_of_tile, target)),
      shade_camera(SIMD_FUNCTION(shade_camera_region, target)),
      make_shadow_rays(SIMD_FUNCTION(make_shadow_rays_of_region, target)),
      shade_shadows(SIMD_FUNCTION(shade_shadows_of_region, target)),
      make_ao_rays(SIMD_FUNCTION(make_ao_rays_of_region, target)),
      shade_ao(SIMD_FUNCTION(shade_ao_of_region, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
