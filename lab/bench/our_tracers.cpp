#include <algorithm>
#include <limits>
#include <memory>

#include "cpu/image/tile_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {
namespace {

/// For tracers with intersect(rays, hits) and occluded(rays, occluded); at most `most` rays a call.
template <class Made>
Tracer batch_by_batch(std::string name, RaysAtOnce at_once, Made tracer, const TraceWork& work) {
    const std::size_t most =
        at_once == RaysAtOnce::kOne ? 1 : std::numeric_limits<std::size_t>::max();
    const auto answers = std::make_shared<TraceAnswers>(work);
    const auto trace = [tracer, most, answers, &work](const WorkPart& part) {
        for_each_tile(work, part, [&](const TileRays& tile) {
            for_each_active_run(work, tile, [&](std::size_t begin, std::size_t end) {
                for (std::size_t count = 0; begin < end; begin += count) {
                    count = std::min(most, end - begin);
                    const auto rays = std::span(work.rays).subspan(begin, count);
                    if (work.any_hit()) {
                        tracer.occluded(rays, std::span(answers->occluded).subspan(begin, count));
                    } else {
                        tracer.intersect(rays, std::span(answers->hits).subspan(begin, count));
                    }
                }
            });
        });
    };
    return {.name = std::move(name), .at_once = at_once, .trace = trace, .answers = [answers] {
                return *answers;
            }};
}

/// Packets of 64 x 64; shadow rays that have too little in common go to single rays.
Tracer packet_by_packet(const Bvh& bvh, const SimdTarget& target, const TraceWork& work) {
    static_assert(kTileSize == cpu::kCameraSide && kBlockSize == cpu::kBlockSide &&
                  kPacketSize == cpu::kBlockRays);
    // Primary hits lie row by row as in an image.
    const auto answers = std::make_shared<TraceAnswers>(work);
    const auto trace = [tiles = std::make_shared<const cpu::TileTracer>(bvh, target), answers,
                        &work](const WorkPart& part) {
        const ImageParams& params = work.params;
        for_each_tile(work, part, [&](const TileRays& rays) {
            if (work.kind == WorkKind::kPrimary) {
                const cpu::Tile& tile = rays.tile;
                const std::size_t first = std::size_t{tile.y0} * params.width + tile.x0;
                tiles->intersect_camera(params, tile, &answers->hits[first], params.width);
            } else {
                const std::size_t count = rays.end - rays.begin;
                tiles->occluded_shared_origin(
                    params.light,
                    std::span(work.shadows).subspan(rays.begin / kPacketSize, count / kPacketSize),
                    std::span(answers->occluded).subspan(rays.begin, count));
            }
        });
    };
    const auto in_ray_order = [answers, &work] {
        TraceAnswers ordered = *answers;
        if (work.any_hit()) return ordered;
        std::size_t ray = 0;
        for (const TileRays& rays : work.tiles) {
            for_each_pixel(rays.tile, [&](std::uint32_t x, std::uint32_t y) {
                ordered.hits[ray++] = answers->hits[std::size_t{y} * work.params.width + x];
            });
        }
        return ordered;
    };
    return {.name = "packet", .trace = trace, .answers = in_ray_order};
}

}  // namespace

std::vector<Tracer> our_tracers(const Bvh& bvh, const SimdTarget& target, const TraceWork& work) {
    const cpu::SingleRayTracer tracer(bvh, target);
    std::vector<Tracer> tracers;
    if (work.kind == WorkKind::kPrimary || work.kind == WorkKind::kShadow)
        tracers.push_back(packet_by_packet(bvh, target, work));
    // The rays of one-ray are handed over one by one.
    if (work.kind != WorkKind::kOneRay)
        tracers.push_back(batch_by_batch("stream", RaysAtOnce::kStream, tracer, work));
    tracers.push_back(batch_by_batch("single", RaysAtOnce::kOne, tracer, work));
    return tracers;
}

AlignedVector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work) {
    const Tracer tracer = batch_by_batch("reference", RaysAtOnce::kStream,
                                         cpu::OneByOne{cpu::ScalarTracer(bvh)}, work);
    tracer.trace(work.whole());
    return tracer.answers().hits;
}

}  // namespace mray::bench
