#include "bench/works/trace_work.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "common/interop/camera.h"
#include "common/interop/surface.h"
#include "cpu/image/tile.h"

namespace mray::bench {
namespace {

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
    const auto square = [](const cpu::Tile& t) {
        return std::pair(t.x0 / kSquareSize, t.y0 / kSquareSize);
    };
    if (!work.squares.empty() && square(work.squares.back().tile) == square(tile)) {
        TileRays& last = work.squares.back();
        last.tile.x1 = std::max(last.tile.x1, tile.x1);
        last.tile.y1 = std::max(last.tile.y1, tile.y1);
        last.end = work.rays.size();
    } else {
        work.squares.push_back(work.tiles.back());
    }
}

}  // namespace

std::size_t count_hits(const TraceWork& work, const TraceAnswers& answers) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        if (work.active[i] == 0) continue;
        count += work.any_hit() ? answers.occluded[i] : answers.hits[i].prim_id != kNoPrim;
    }
    return count;
}

void to_ray_order(const TraceWork& work, std::vector<Hit>& hits) {
    std::vector<Hit> ordered;
    ordered.reserve(hits.size());
    for (const TileRays& rays : work.tiles) {
        for_each_pixel(rays.tile, [&](std::uint32_t x, std::uint32_t y) {
            ordered.push_back(hits[std::size_t{y} * work.params.width + x]);
        });
    }
    hits = std::move(ordered);
}

TraceWork make_primary_work(const ImageParams& params) {
    assert(params.width % kTileSize == 0 && params.height % kTileSize == 0);
    TraceWork work;
    work.params = params;
    work.params.rays = kRaysPrimary;
    work.rays.reserve(std::size_t{params.width} * params.height);
    const cpu::ImageTiles squares(params.width, params.height, kSquareSize);
    for (std::uint32_t i = 0; i < squares.count(); ++i) {
        const cpu::Tile square = squares[i];
        for (std::uint32_t y = square.y0; y < square.y1; y += kTileSize) {
            for (std::uint32_t x = square.x0; x < square.x1; x += kTileSize) {
                const cpu::Tile tile{x, y, x + kTileSize, y + kTileSize};
                const std::size_t begin = work.rays.size();
                for_each_pixel(tile, [&](std::uint32_t px, std::uint32_t py) {
                    work.rays.push_back(camera_ray(params.camera, px, py));
                });
                close_tile(work, tile, begin);
            }
        }
    }
    return work;
}

TraceWork make_secondary_work(const TraceWork& primary, std::span<const Hit> hits,
                              const cpu::ShadedMesh& mesh, std::uint32_t rays) {
    TraceWork work;
    work.params = primary.params;
    work.params.rays = rays;
    const ImageParams& params = work.params;
    for (const TileRays& seen : primary.tiles) {
        const std::size_t begin = work.rays.size();
        std::size_t i = seen.begin;
        for_each_pixel(seen.tile, [&](std::uint32_t x, std::uint32_t y) {
            const Ray& ray = primary.rays[i];
            const Hit& hit = hits[i];
            ++i;
            const bool missed = hit.prim_id == kNoPrim;
            if (rays == kRaysShadow) {
                const Surface surface = missed ? Surface{} : mesh.surface(ray, hit);
                const bool traced = !missed && faces_light(surface, params.light);
                work.rays.push_back(traced ? shadow_ray(surface, params.light)
                                           : inactive_ray(params.light));
            } else if (!missed) {
                const Surface surface = mesh.surface(ray, hit);
                for (std::uint32_t sample = 0; sample < params.ao_count; ++sample) {
                    work.rays.push_back(ao_ray(surface, x, y, sample, params.ao_tfar));
                }
            }
        });
        close_tile(work, seen.tile, begin);
    }
    if (rays != kRaysShadow) return work;
    work.shadows.resize(work.rays.size() / kPacketSize);
    for (std::size_t i = 0; i < work.rays.size(); ++i)
        work.shadows[i / kPacketSize].set(i % kPacketSize, work.rays[i]);
    return work;
}

}  // namespace mray::bench
