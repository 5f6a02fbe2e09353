// Rays to trace, the same for all methods.
#pragma once

#include <tbb/parallel_for.h>

#include <cstdint>
#include <span>
#include <vector>

#include "common/bvh/bvh.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"
#include "cpu/image/image_tracer.h"

namespace mray::bench {

inline constexpr std::uint32_t kTileSize = 32;
inline constexpr std::uint32_t kSquareSize = 2 * kTileSize;
inline constexpr std::uint32_t kBlockSize = 4;
inline constexpr std::size_t kPacketSize = 16;

/// A tile of the image and its rays, which are consecutive.
struct TileRays {
    cpu::Tile tile;
    std::size_t begin;
    std::size_t end;
};

/// The rays of an image, tile after tile, those of squares of 2 x 2 tiles together. Within a tile
/// they come in packets of 16: for primary and shadow rays the 4x4 blocks in Morton order, each
/// with its pixels row by row, so that ray i of every tile is the same pixel of it; for ambient
/// occlusion the samples of one pixel after the other, block by block. Slots without a ray are
/// inactive: those without a surface or with one that faces away from the light, and the rest of a
/// last packet.
struct TraceWork {
    /// params.rays says which rays these are.
    ImageParams params;
    std::vector<Ray> rays;
    /// 1 if rays[i] is active, else 0.
    std::vector<std::uint8_t> active;
    /// The shadow rays in the layout of packets: rays[i] is ray i % kPacketSize of
    /// shadows[i / kPacketSize].
    std::vector<cpu::SharedOriginRays> shadows;
    std::vector<TileRays> tiles;
    /// The rays of the tiles of each square, without squares that have none.
    std::vector<TileRays> squares;
    std::size_t active_count = 0;

    bool any_hit() const { return params.rays != kRaysPrimary; }
};

/// hits[i] or occluded[i] (0 or 1) is the answer for ray i of a work; the other array is empty.
/// Answers for inactive rays have no meaning.
struct TraceAnswers {
    std::vector<Hit> hits;
    std::vector<std::uint8_t> occluded;

    explicit TraceAnswers(const TraceWork& work)
        : hits(work.any_hit() ? 0 : work.rays.size()),
          occluded(work.any_hit() ? work.rays.size() : 0) {}
};

/// The blocks of shadow rays of a tile, or a square.
inline std::span<const cpu::SharedOriginRays> shadows_of(const TraceWork& work,
                                                         const TileRays& rays) {
    static_assert(kPacketSize == cpu::kBlockRays);
    return std::span(work.shadows)
        .subspan(rays.begin / kPacketSize, (rays.end - rays.begin) / kPacketSize);
}

/// How many active rays hit something.
std::size_t count_hits(const TraceWork& work, const TraceAnswers& answers);

/// Calls visit(x, y) for the pixels of a tile in the order of their rays.
template <class Visit>
void for_each_pixel(const cpu::Tile& tile, Visit visit) {
    static_assert(kTileSize == 8 * kBlockSize);
    for (std::uint32_t i = 0; i < 64; ++i) {
        const std::uint32_t block_x =
            tile.x0 + kBlockSize * ((i & 1) | (i >> 1 & 2) | (i >> 2 & 4));
        const std::uint32_t block_y =
            tile.y0 + kBlockSize * ((i >> 1 & 1) | (i >> 2 & 2) | (i >> 3 & 4));
        for (std::uint32_t y = block_y; y < block_y + kBlockSize; ++y) {
            for (std::uint32_t x = block_x; x < block_x + kBlockSize; ++x) visit(x, y);
        }
    }
}

/// Calls visit(begin, end) for the longest runs of active rays of a tile.
template <class Visit>
void for_each_active_run(const TraceWork& work, const TileRays& tile, Visit visit) {
    for (std::size_t i = tile.begin; i < tile.end;) {
        if (work.active[i] == 0) {
            ++i;
            continue;
        }
        const std::size_t begin = i;
        while (i < tile.end && work.active[i] != 0) ++i;
        visit(begin, i);
    }
}

/// Calls visit(tile) for all tiles, in the calling thread's arena.
template <class Visit>
void for_each_tile(const TraceWork& work, Visit visit) {
    tbb::parallel_for(std::size_t{0}, work.tiles.size(),
                      [&](std::size_t i) { visit(work.tiles[i]); });
}

/// Reorders hits from the rows of an image to the rays of a primary work.
void to_ray_order(const TraceWork& work, std::vector<Hit>& hits);

/// params.width and height must be multiples of kTileSize.
TraceWork make_primary_work(const ImageParams& params);

/// The rays from the surfaces of `hits`, which are the hits of `primary`. `rays` is kRaysShadow or
/// kRaysAo.
TraceWork make_secondary_work(const TraceWork& primary, std::span<const Hit> hits,
                              const cpu::ShadedMesh& mesh, std::uint32_t rays);

}  // namespace mray::bench
