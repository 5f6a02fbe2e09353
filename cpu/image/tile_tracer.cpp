#include "cpu/image/tile_tracer.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace mray::cpu {
namespace {

/// The most ambient-occlusion rays that are traced together, so that they stay in the cache; one
/// block may have more.
constexpr std::uint32_t kMostAoRays = 2048;

void trace_shadows(const TileTracer& tracer, const PixelPart& part) {
    const Tile& tile = part.tile;
    const std::size_t count =
        light_packet_squares(tile.x1 - tile.x0, tile.y1 - tile.y0) * std::size_t{kSquareRays};
    ShadowRays& shadow = tracer.shadow_rays();
    shadow.rays.assign(count / kBlockRays, SharedOriginRays::none());
    shadow.lit.resize(count);
    shadow.occluded.assign(count, 1);
    if (tracer.shader().make_shadow_rays(part, shadow.rays.data(), shadow.lit.data()))
        tracer.occluded_shared_origin(part.params.light, shadow.rays, shadow.occluded);
    tracer.shader().shade_shadows(part, shadow.occluded.data(), shadow.lit.data());
}

void trace_ao(const TileTracer& tracer, const PixelPart& part, const Watch& watch) {
    const Tile& tile = part.tile;
    const std::uint32_t blocks = std::max(kMostAoRays / (kBlockRays * part.params.ao_count), 1u);
    const std::uint32_t width = blocks * kBlockSide;
    std::vector<Ray> rays;
    std::vector<std::uint8_t> occluded;
    for (std::uint32_t y = tile.y0; y < tile.y1; y += kBlockSide) {
        for (std::uint32_t x = tile.x0; x < tile.x1; x += width) {
            watch.throw_if_cancelled();
            const Tile run{x, y, std::min(x + width, tile.x1), std::min(y + kBlockSide, tile.y1)};
            const PixelPart pixels{part.params, part.mesh, run, part.frame};
            tracer.shader().make_ao_rays(pixels, rays);
            occluded.resize(rays.size());
            tracer.occluded(rays, occluded);
            tracer.shader().shade_ao(pixels, occluded.data());
        }
    }
}

}  // namespace

void trace_tile(const TileTracer& tracer, const ShadedMesh& mesh, const ImageParams& params,
                const Tile& tile, Frame& frame, const Watch& watch) {
    tracer.intersect_camera(
        params, tile, &frame.hits[std::size_t{tile.y0} * params.width + tile.x0], params.width);
    watch.throw_if_cancelled();
    const PixelPart part{params, mesh, tile, frame};
    if (params.rays == kRaysShadow) {
        trace_shadows(tracer, part);
    } else if (params.rays == kRaysAo) {
        trace_ao(tracer, part, watch);
    } else {
        tracer.shader().shade_camera(part);
    }
}

}  // namespace mray::cpu
