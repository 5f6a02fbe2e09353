#include "lab/bench/ours.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "cpu/image/tile_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"

namespace mray::bench {
namespace {

constexpr WorkKind kAllWorks[] = {WorkKind::kPrimary, WorkKind::kShadow, WorkKind::kDiffuse,
                                  WorkKind::kAo, WorkKind::kOneRay};
/// Works whose rays are not handed over one by one.
constexpr WorkKind kTiledWorks[] = {WorkKind::kPrimary, WorkKind::kShadow, WorkKind::kDiffuse,
                                    WorkKind::kAo};

/// For tracers with intersect(rays, hits) and occluded(rays, occluded), of any rays; in calls of at
/// most `most` rays.
template <class Tracer>
OurTracer batch_by_batch(std::string name, std::string target, RaysAtOnce at_once, Tracer tracer) {
    const std::size_t most =
        at_once == RaysAtOnce::kOne ? 1 : std::numeric_limits<std::size_t>::max();
    const auto trace = [tracer, most](const TraceWork& work, const WorkPart& part,
                                      TraceAnswers& answers) {
        for_each_tile(work, part, [&](const TileRays& tile) {
            for_each_active_run(work, tile, [&](std::size_t begin, std::size_t end) {
                for (std::size_t count = 0; begin < end; begin += count) {
                    count = std::min(most, end - begin);
                    const auto rays = std::span(work.rays).subspan(begin, count);
                    if (work.any_hit()) {
                        tracer.occluded(rays, std::span(answers.occluded).subspan(begin, count));
                    } else {
                        tracer.intersect(rays, std::span(answers.hits).subspan(begin, count));
                    }
                }
            });
        });
    };
    const std::span<const WorkKind> works =
        at_once == RaysAtOnce::kOne ? std::span(kAllWorks) : std::span<const WorkKind>(kTiledWorks);
    return {std::move(name), std::move(target), at_once, {works.begin(), works.end()}, trace};
}

/// Packets of 64 x 64 rays; shadow rays that have too little in common go to single rays.
OurTracer packet_by_packet(const Bvh& bvh, const SimdTarget& target) {
    const auto trace = [tiles = std::make_shared<const cpu::TileTracer>(bvh, target)](
                           const TraceWork& work, const WorkPart& part, TraceAnswers& answers) {
        static_assert(kTileSize == cpu::kSquareSide && kBlockSize == cpu::kBlockSide &&
                      kSquareSize == cpu::kCameraSide);
        const ImageParams& params = work.params;
        tbb::parallel_for(part.first_square, part.end_square, [&](std::size_t i) {
            const TileRays& rays = work.squares[i];
            if (work.kind == WorkKind::kPrimary) {
                const cpu::Tile& tile = rays.tile;
                const std::size_t first = std::size_t{tile.y0} * params.width + tile.x0;
                tiles->intersect_camera(params, tile, &answers.hits[first], params.width);
            } else {
                tiles->occluded_shared_origin(
                    params.light, shadows_of(work, rays),
                    std::span(answers.occluded).subspan(rays.begin, rays.end - rays.begin));
            }
        });
    };
    return {"packet", target.name, RaysAtOnce::kPacket, {WorkKind::kPrimary, WorkKind::kShadow},
            trace,    true};
}

OurTracer reference(const Bvh& bvh) {
    return batch_by_batch("reference", "scalar", RaysAtOnce::kStream,
                          cpu::OneByOne{cpu::ScalarTracer(bvh)});
}

}  // namespace

OurTracer ray_streams(const Bvh& bvh, const SimdTarget& target) {
    return batch_by_batch("stream", target.name, RaysAtOnce::kStream,
                          cpu::SingleRayTracer(bvh, target));
}

OurTracer single_rays(const Bvh& bvh, const SimdTarget& target) {
    return batch_by_batch("single", target.name, RaysAtOnce::kOne,
                          cpu::SingleRayTracer(bvh, target));
}

std::vector<OurTracer> our_tracers(const Bvh& bvh, std::span<const SimdTarget> targets) {
    std::vector<OurTracer> tracers;
    for (const SimdTarget& target : targets) {
        tracers.push_back(packet_by_packet(bvh, target));
        tracers.push_back(ray_streams(bvh, target));
        tracers.push_back(single_rays(bvh, target));
    }
    if (targets.back() == supported_simd_targets().back()) tracers.push_back(reference(bvh));
    return tracers;
}

AlignedVector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work) {
    TraceAnswers answers(work);
    reference(bvh).trace(work, answers);
    return std::move(answers.hits);
}

}  // namespace mray::bench
