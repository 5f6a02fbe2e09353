#include "lab/bench/embree/embree_pixels.h"

#include <cassert>
#include <vector>

#include "lab/bench/embree/embree_records.h"

namespace mray::bench {
namespace {

bool occluded(RTCScene scene, embree::Query& query, const Ray& ray) {
    RTCRay record;
    set_ray(record, 0, ray);
    query.occluded1(scene, record);
    return record.tfar < 0;
}

void trace_shadows(RTCScene scene, const cpu::PixelShader& shader, const cpu::PixelPart& part) {
    embree::Query query(embree::Coherence::kCoherent);
    cpu::SharedOriginRays rays[cpu::kSquareBlocks];
    cpu::LitPixels lit[cpu::kSquareBlocks];
    shader.make_shadow_rays(part, rays, lit);
    for (std::uint32_t y = part.tile.y0; y < part.tile.y1; ++y) {
        for (std::uint32_t x = part.tile.x0; x < part.tile.x1; ++x) {
            const std::size_t pixel = std::size_t{y} * part.params.width + x;
            if (part.frame.hits[pixel].prim_id == kNoPrim) continue;
            const std::uint32_t i = cpu::light_packet_ray(x - part.tile.x0, y - part.tile.y0);
            const cpu::SharedOriginRays& block = rays[i / cpu::kBlockRays];
            const std::uint32_t lane = i % cpu::kBlockRays;
            part.frame.occlusion[pixel] =
                !block.has(lane) || occluded(scene, query, block.ray(part.params.light, lane));
        }
    }
}

/// Traces a row of blocks.
void trace_ao(RTCScene scene, const cpu::PixelShader& shader, const cpu::PixelPart& part) {
    embree::Query query(embree::Coherence::kIncoherent);
    std::vector<Ray> rays;
    shader.make_ao_rays(part, rays);
    auto ray = rays.begin();
    const cpu::Tile& tile = part.tile;
    for (std::uint32_t x0 = tile.x0; x0 < tile.x1; x0 += cpu::kBlockSide) {
        for (std::uint32_t i = 0; i < cpu::kBlockRays; ++i) {
            const std::uint32_t y = tile.y0 + i % cpu::kBlockSide;
            const std::size_t pixel = std::size_t{y} * part.params.width + x0 + i / cpu::kBlockSide;
            if (part.frame.hits[pixel].prim_id == kNoPrim) continue;
            std::uint32_t& count = part.frame.occlusion[pixel];
            count = 0;
            for (std::uint32_t k = 0; k < part.params.ao_count; ++k)
                count += occluded(scene, query, *ray++);
        }
    }
}

}  // namespace

void trace_pixels(const EmbreeScene& scene, const TraceWork& work, const cpu::ShadedMesh& mesh,
                  const cpu::PixelShader& shader, Frame& frame) {
    static_assert(kTileSize == cpu::kSquareSide);
    assert(work.any_hit());
    for_each_tile(work, work.whole(), [&](const TileRays& rays) {
        const FlushedDenormals flushed;
        if (work.kind == WorkKind::kShadow) {
            trace_shadows(scene.handle(), shader, {work.params, mesh, rays.tile, frame});
            return;
        }
        cpu::Tile row = rays.tile;
        for (; row.y0 < rays.tile.y1; row.y0 += cpu::kBlockSide) {
            row.y1 = row.y0 + cpu::kBlockSide;
            trace_ao(scene.handle(), shader, {work.params, mesh, row, frame});
        }
    });
}

}  // namespace mray::bench
