#include "lab/methods/tracers.h"

#include <cassert>
#include <cmath>

#include "cpu/reference/scalar_tracer.h"

namespace mray::lab {
namespace {

Ray inactive_ray(vec3 org) { return {org, 0, {0, 0, 1}, -1}; }

void add_secondary_rays(RaySet& set, const cpu::ShadedMesh& mesh, std::uint32_t x, std::uint32_t y,
                        const Ray& ray, const Hit& hit) {
    const ImageParams& params = set.params;
    const bool missed = hit.prim_id == kNoPrim;
    if (set.kind == RayKind::kShadow) {
        const Surface surface = missed ? Surface{} : mesh.surface(ray, hit);
        const bool traced = !missed && faces_light(surface, params.light);
        set.rays.push_back(traced ? shadow_ray(surface, params.light) : inactive_ray(params.light));
        return;
    }
    if (missed) return;
    const Surface surface = mesh.surface(ray, hit);
    if (set.kind == RayKind::kDiffuse) {
        // The directions of neighbours have nothing to do with each other.
        const std::uint32_t number = mix_bits(x + mix_bits(y));
        const vec3 dir = canonical_direction(ao_direction(surface, sphere_point(number)));
        set.rays.push_back({off_surface(surface, surface.size), 0, dir, kInfiniteT});
        return;
    }
    for (std::uint32_t sample = 0; sample < params.ao_count; ++sample)
        set.rays.push_back(ao_ray(surface, x, y, sample, params.ao_tfar));
}

}  // namespace

const char* name_of(RayKind kind) {
    constexpr std::array kNames = {"primary", "shadow", "diffuse", "ao", "one-ray", "aimed"};
    return kNames[static_cast<std::size_t>(kind)];
}

std::vector<TileRange> RaySet::ranges(std::size_t count) const {
    count = std::clamp<std::size_t>(count, 1, std::max<std::size_t>(1, tiles.size()));
    std::vector<TileRange> ranges;
    for (std::size_t i = 0; i < count; ++i)
        ranges.push_back({i * tiles.size() / count, (i + 1) * tiles.size() / count});
    return ranges;
}

void RaySet::close_tile(const cpu::Tile& tile) {
    while (rays.size() % kPacketSize != 0) rays.push_back(inactive_ray({0, 0, 0}));
    const std::size_t begin = active.size();
    active.resize(rays.size());
    for (std::size_t i = begin; i < rays.size(); ++i) {
        active[i] = rays[i].tfar >= rays[i].tnear;
        active_count += active[i];
    }
    tiles.push_back({tile, begin, rays.size()});
}

std::uint64_t count_mismatches(const RaySet& set, const TraceAnswers& a, const TraceAnswers& b) {
    constexpr float kMaxRelativeT = 1e-4f;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        if (set.active[i] == 0) continue;
        if (set.any_hit()) {
            count += a.occluded[i] != b.occluded[i];
            continue;
        }
        const Hit& hit = a.hits[i];
        const bool is_same_t =
            hit.prim_id == kNoPrim || std::fabs(hit.t - b.hits[i].t) <= kMaxRelativeT * hit.t;
        count += hit.prim_id != b.hits[i].prim_id || !is_same_t;
    }
    return count;
}

std::uint64_t count_other_triangles(std::span<const Hit> a, std::span<const Hit> b) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) count += a[i].prim_id != b[i].prim_id;
    return count;
}

RaySet make_primary_rays(const ImageParams& params, RayKind kind) {
    assert(params.width % kTileSize == 0 && params.height % kTileSize == 0);
    RaySet set;
    set.kind = kind;
    set.params = params;
    set.params.rays = kRaysPrimary;
    set.rays.reserve(std::size_t{params.width} * params.height);
    const auto add = [&](std::uint32_t x, std::uint32_t y) {
        set.rays.push_back(camera_ray(params.camera, x, y));
    };
    const cpu::ImageTiles tiles(params.width, params.height, kTileSize);
    for (std::uint32_t i = 0; kind == RayKind::kPrimary && i < tiles.count(); ++i) {
        for_each_pixel(tiles[i], add);
        set.close_tile(tiles[i]);
    }
    for (std::uint32_t y = 0; kind == RayKind::kOneRay && y < params.height; ++y) {
        for (std::uint32_t x = 0; x < params.width; ++x) add(x, y);
        const std::uint32_t end = y + 1;
        if (end % kTileSize == 0) set.close_tile({0, end - kTileSize, params.width, end});
    }
    return set;
}

RaySet make_secondary_rays(const RaySet& primary, std::span<const Hit> hits,
                           const cpu::ShadedMesh& mesh, RayKind kind, std::uint32_t samples) {
    RaySet set;
    set.kind = kind;
    set.params = primary.params;
    set.params.rays = kind == RayKind::kShadow ? kRaysShadow : kRaysAo;
    if (kind == RayKind::kAo) set.params.ao_count = samples;
    // At most 2^28 pixels and 2^8 samples.
    const std::size_t all_rays = primary.active_count * (kind == RayKind::kAo ? samples : 1);
    const std::size_t pixels = primary.rays.size();
    const std::size_t stride = std::max<std::size_t>(1, (all_rays + pixels - 1) / pixels);
    for (const TileRays& seen : primary.tiles) {
        // Three tiles on in each row of tiles, so that no column has all.
        const std::size_t number =
            seen.tile.x0 / kTileSize + std::size_t{3} * (seen.tile.y0 / kTileSize);
        if (number % stride == 0) {
            std::size_t i = seen.begin;
            for_each_pixel(seen.tile, [&](std::uint32_t x, std::uint32_t y) {
                add_secondary_rays(set, mesh, x, y, primary.rays[i], hits[i]);
                ++i;
            });
        }
        set.close_tile(seen.tile);
    }
    if (kind != RayKind::kShadow) return set;
    set.shadows.resize(set.rays.size() / kPacketSize);
    for (std::size_t i = 0; i < set.rays.size(); ++i)
        set.shadows[i / kPacketSize].set(i % kPacketSize, set.rays[i]);
    return set;
}

Tracer tile_tracer(std::string name, std::shared_ptr<const cpu::ImageTracer> tracer,
                   const RaySet& set, std::shared_ptr<TraceAnswers> answers) {
    static_assert(kTileSize == cpu::kCameraSide && kBlockSize == cpu::kBlockSide &&
                  kPacketSize == cpu::kBlockRays && sizeof(StoredRay) == sizeof(Ray));
    if (answers == nullptr) answers = std::make_shared<TraceAnswers>(set);
    // Primary hits lie row by row as in an image, those of aimed rays row by row in their tile.
    const bool is_image = set.kind == RayKind::kPrimary;
    const std::size_t stride = is_image ? set.params.width : kTileSize;
    const auto first_of = [=](const TileRays& rays) {
        return is_image ? rays.tile.y0 * stride + rays.tile.x0 : rays.begin;
    };
    const auto trace = [=, &set](const TileRange& range) {
        for_each_tile(set, range, [&](const TileRays& rays) {
            const std::size_t count = rays.end - rays.begin;
            if (is_image) {
                tracer->intersect_camera(set.params, rays.tile, &answers->hits[first_of(rays)],
                                         stride);
            } else if (set.kind == RayKind::kShadow) {
                tracer->occluded_shared_origin(
                    set.params.light,
                    std::span(set.shadows).subspan(rays.begin / kPacketSize, count / kPacketSize),
                    std::span(answers->occluded).subspan(rays.begin, count));
            } else if (const StoredRay* const stored = &set.stored[rays.begin];
                       !tracer->intersect_stored(
                           {stored, kTileSize, kTileSize, kTileSize, set.rays[rays.begin].org},
                           &answers->hits[rays.begin])) {
                tracer->intersect({reinterpret_cast<const Ray*>(stored), count},
                                  std::span(answers->hits).subspan(rays.begin, count));
            }
        });
    };
    const auto in_ray_order = [=, &set] {
        TraceAnswers ordered = *answers;
        if (set.any_hit()) return ordered;
        std::size_t ray = 0;
        for (const TileRays& rays : set.tiles) {
            for_each_pixel(rays.tile, [&](std::uint32_t x, std::uint32_t y) {
                const auto [x0, y0, x1, y1] = rays.tile;
                ordered.hits[ray++] = answers->hits[first_of(rays) + (y - y0) * stride + (x - x0)];
            });
        }
        return ordered;
    };
    return {.name = std::move(name), .trace = trace, .answers = in_ray_order};
}

std::vector<Tracer> our_tracers(const Bvh& bvh, const SimdTarget& target, const RaySet& set) {
    std::vector<Tracer> tracers;
    const auto single = std::make_shared<const cpu::SingleRayTracer>(bvh, target);
    if (set.in_packets())
        tracers.push_back(
            tile_tracer("packet", std::make_shared<const cpu::TileTracer>(bvh, target), set));
    // The rays of one-ray are handed over one by one.
    if (set.kind != RayKind::kOneRay)
        tracers.push_back(batch_tracer("stream", RaysAtOnce::kStream, single, set));
    tracers.push_back(batch_tracer("single", RaysAtOnce::kOne, single, set));
    return tracers;
}

Tracer reference_tracer(const Bvh& bvh, const RaySet& set) {
    using Scalar = cpu::OneByOne<cpu::ScalarTracer>;
    return batch_tracer("reference", RaysAtOnce::kStream,
                        std::make_shared<const Scalar>(cpu::ScalarTracer(bvh)), set);
}

TraceAnswers trace_all(const Tracer& tracer, const RaySet& set) {
    tracer.trace(set.whole());
    return tracer.answers();
}

}  // namespace mray::lab
