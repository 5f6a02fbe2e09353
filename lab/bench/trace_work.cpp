#include "lab/bench/trace_work.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "cpu/packet/packet_frame.h"

namespace mray::bench {
namespace {

/// As many rays in all as an image has pixels, so that each work takes about as long.
constexpr std::uint32_t kAoSamples = 4;

Ray inactive_ray(vec3 org) {
    Ray ray;
    ray.org = org;
    ray.tnear = 0;
    ray.dir = {0, 0, 1};
    ray.tfar = -1;
    return ray;
}

/// Adds a tile whose rays are those since `begin`, filled up to whole packets.
void close_tile(TraceWork& work, const cpu::Tile& tile, std::size_t begin) {
    while (work.rays.size() % kPacketSize != 0) work.rays.push_back(inactive_ray({0, 0, 0}));
    work.active.resize(work.rays.size());
    for (std::size_t i = begin; i < work.rays.size(); ++i) {
        work.active[i] = work.rays[i].tfar >= work.rays[i].tnear;
        work.active_count += work.active[i];
    }
    work.tiles.push_back({tile, begin, work.rays.size()});
}

void add_secondary_rays(TraceWork& work, const cpu::ShadedMesh& mesh, std::uint32_t x,
                        std::uint32_t y, const Ray& ray, const Hit& hit) {
    const ImageParams& params = work.params;
    const bool missed = hit.prim_id == kNoPrim;
    if (work.kind == WorkKind::kShadow) {
        const Surface surface = missed ? Surface{} : mesh.surface(ray, hit);
        const bool traced = !missed && faces_light(surface, params.light);
        work.rays.push_back(traced ? shadow_ray(surface, params.light)
                                   : inactive_ray(params.light));
        return;
    }
    if (missed) return;
    const Surface surface = mesh.surface(ray, hit);
    if (work.kind == WorkKind::kDiffuse) {
        // The directions of neighbours have nothing to do with each other.
        const std::uint32_t number = mix_bits(x + mix_bits(y));
        Ray bounced;
        bounced.org = off_surface(surface, surface.size);
        bounced.tnear = 0;
        bounced.dir = canonical_direction(ao_direction(surface, sphere_point(number)));
        bounced.tfar = kInfiniteT;
        work.rays.push_back(bounced);
        return;
    }
    for (std::uint32_t sample = 0; sample < params.ao_count; ++sample)
        work.rays.push_back(ao_ray(surface, x, y, sample, params.ao_tfar));
}

}  // namespace

const char* name_of(WorkKind kind) {
    constexpr std::array kNames = {"primary", "shadow", "diffuse", "ao", "one-ray"};
    return kNames[static_cast<std::size_t>(kind)];
}

std::vector<WorkPart> TraceWork::parts(std::size_t count) const {
    count = std::clamp<std::size_t>(count, 1, std::max<std::size_t>(1, tiles.size()));
    std::vector<WorkPart> parts;
    for (std::size_t i = 0; i < count; ++i)
        parts.push_back({i * tiles.size() / count, (i + 1) * tiles.size() / count});
    return parts;
}

std::uint64_t count_mismatches(const TraceWork& work, std::span<const Hit> a,
                               std::span<const Hit> b) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        const bool is_same_t =
            a[i].prim_id == kNoPrim || std::fabs(a[i].t - b[i].t) <= kMaxRelativeT * a[i].t;
        count += work.active[i] != 0 && (a[i].prim_id != b[i].prim_id || !is_same_t);
    }
    return count;
}

std::uint64_t count_mismatches(const TraceWork& work, const TraceAnswers& a,
                               const TraceAnswers& b) {
    if (!work.any_hit()) return count_mismatches(work, a.hits, b.hits);
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < work.rays.size(); ++i)
        count += work.active[i] != 0 && a.occluded[i] != b.occluded[i];
    return count;
}

TraceWork make_primary_work(const ImageParams& params) {
    assert(params.width % kTileSize == 0 && params.height % kTileSize == 0);
    TraceWork work;
    work.params = params;
    work.params.rays = kRaysPrimary;
    work.rays.reserve(std::size_t{params.width} * params.height);
    const cpu::ImageTiles tiles(params.width, params.height, kTileSize);
    for (std::uint32_t i = 0; i < tiles.count(); ++i) {
        const std::size_t begin = work.rays.size();
        for_each_pixel(tiles[i], [&](std::uint32_t x, std::uint32_t y) {
            work.rays.push_back(camera_ray(params.camera, x, y));
        });
        close_tile(work, tiles[i], begin);
    }
    return work;
}

TraceWork make_row_work(const ImageParams& params) {
    TraceWork work;
    work.kind = WorkKind::kOneRay;
    work.params = params;
    work.params.rays = kRaysPrimary;
    for (std::uint32_t y0 = 0; y0 < params.height; y0 += kTileSize) {
        const std::size_t begin = work.rays.size();
        for (std::uint32_t y = y0; y < y0 + kTileSize; ++y)
            for (std::uint32_t x = 0; x < params.width; ++x)
                work.rays.push_back(camera_ray(params.camera, x, y));
        close_tile(work, {0, y0, params.width, y0 + kTileSize}, begin);
    }
    return work;
}

TraceWork make_secondary_work(const TraceWork& primary, std::span<const Hit> hits,
                              const cpu::ShadedMesh& mesh, WorkKind kind, std::uint32_t samples,
                              std::size_t most_rays) {
    TraceWork work;
    work.kind = kind;
    work.params = primary.params;
    work.params.rays = kind == WorkKind::kShadow ? kRaysShadow : kRaysAo;
    if (kind == WorkKind::kAo) work.params.ao_count = samples;
    // At most 2^28 pixels and 2^8 samples.
    const std::size_t all_rays = primary.active_count * (kind == WorkKind::kAo ? samples : 1);
    const std::size_t stride =
        all_rays <= most_rays ? 1 : all_rays / most_rays + (all_rays % most_rays != 0);
    for (const TileRays& seen : primary.tiles) {
        const std::size_t begin = work.rays.size();
        // Three tiles on in each row of tiles, so that no column has all.
        const std::size_t place =
            seen.tile.x0 / kTileSize + std::size_t{3} * (seen.tile.y0 / kTileSize);
        if (place % stride == 0) {
            std::size_t i = seen.begin;
            for_each_pixel(seen.tile, [&](std::uint32_t x, std::uint32_t y) {
                add_secondary_rays(work, mesh, x, y, primary.rays[i], hits[i]);
                ++i;
            });
        }
        close_tile(work, seen.tile, begin);
    }
    if (kind != WorkKind::kShadow) return work;
    work.shadows.resize(work.rays.size() / kPacketSize);
    for (std::size_t i = 0; i < work.rays.size(); ++i)
        work.shadows[i / kPacketSize].set(i % kPacketSize, work.rays[i]);
    return work;
}

SceneRays::SceneRays(const BenchScene& scene)
    : scene_(scene),
      primary_(make_primary_work(scene.params)),
      hits_(reference_hits(scene.bvh, primary_)) {}

TraceWork SceneRays::work(WorkKind kind) const {
    if (kind == WorkKind::kPrimary) return primary_;
    if (kind == WorkKind::kOneRay) return make_row_work(scene_.params);
    return make_secondary_work(primary_, hits_, scene_.mesh(), kind, kAoSamples,
                               primary_.rays.size());
}

}  // namespace mray::bench
