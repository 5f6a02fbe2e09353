#include "bench/works/ours.h"

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/image/tile_tracer.h"
#include "cpu/reference/scalar_tracer.h"
#include "cpu/refit/refit.h"
#include "cpu/single_ray/single_ray_tracer.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace mray::bench {
namespace {

/// ScalarTracer by the batch.
class ScalarBatches {
public:
    explicit ScalarBatches(const Bvh& bvh) : tracer_(bvh) {}

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) const {
        for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = tracer_.intersect(rays[i]);
    }
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) const {
        for (std::size_t i = 0; i < rays.size(); ++i) occluded[i] = tracer_.occluded(rays[i]);
    }

private:
    cpu::ScalarTracer tracer_;
};

/// For tracers with intersect(rays, hits) and occluded(rays, occluded), of any rays.
template <class Tracer>
OurTracer batch_by_batch(std::string name, std::string target, Tracer tracer) {
    const auto trace = [tracer](const TraceWork& work, TraceAnswers& answers) {
        for_each_tile(work, [&](const TileRays& tile) {
            for_each_active_run(work, tile, [&](std::size_t begin, std::size_t end) {
                const std::size_t count = end - begin;
                const auto rays = std::span(work.rays).subspan(begin, count);
                if (work.any_hit()) {
                    tracer.occluded(rays, std::span(answers.occluded).subspan(begin, count));
                } else {
                    tracer.intersect(rays, std::span(answers.hits).subspan(begin, count));
                }
            });
        });
    };
    return {std::move(name), std::move(target), {kRaysPrimary, kRaysShadow, kRaysAo}, trace};
}

/// Packets of 64 x 64 rays; shadow rays that have too little in common go to single rays.
OurTracer packet_by_packet(const Bvh& bvh, const SimdTarget& target) {
    const auto trace = [tiles = std::make_shared<const cpu::TileTracer>(bvh, target)](
                           const TraceWork& work, TraceAnswers& answers) {
        static_assert(kTileSize == cpu::kSquareSide && kBlockSize == cpu::kBlockSide);
        const ImageParams& params = work.params;
        if (!work.any_hit()) {
            const cpu::ImageTiles image(params.width, params.height, cpu::kCameraSide);
            tbb::parallel_for(std::uint32_t{0}, image.count(), [&](std::uint32_t i) {
                const cpu::Tile tile = image[i];
                const std::size_t first = std::size_t{tile.y0} * params.width + tile.x0;
                tiles->intersect_camera(params, tile, &answers.hits[first], params.width);
            });
            return;
        }
        tbb::parallel_for(std::size_t{0}, work.squares.size(), [&](std::size_t i) {
            const TileRays& rays = work.squares[i];
            tiles->occluded_shared_origin(
                params.light, shadows_of(work, rays),
                std::span(answers.occluded).subspan(rays.begin, rays.end - rays.begin));
        });
    };
    return {"packet", target.name, {kRaysPrimary, kRaysShadow}, trace, true};
}

}  // namespace

OurTracer single_rays(const Bvh& bvh, const SimdTarget& target) {
    return batch_by_batch("single", target.name, cpu::SingleRayTracer(bvh, target));
}

std::vector<OurTracer> our_tracers(const Bvh& bvh, std::span<const SimdTarget> targets) {
    std::vector<OurTracer> tracers;
    for (const SimdTarget& target : targets) {
        tracers.push_back(packet_by_packet(bvh, target));
        tracers.push_back(single_rays(bvh, target));
    }
    if (targets.back() == supported_simd_targets().back()) {
        tracers.push_back(batch_by_batch("reference", "scalar", ScalarBatches(bvh)));
    }
    return tracers;
}

std::vector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work) {
    TraceAnswers answers(work);
    batch_by_batch("reference", "scalar", ScalarBatches(bvh)).trace(work, answers);
    return std::move(answers.hits);
}

std::vector<OurRefit> our_refits() {
    return {{"levels", best_simd_target().name,
             [](Bvh& bvh, std::span<const vec3> positions) { cpu::refit(bvh, positions); }}};
}

std::vector<OurBuild> our_builds() {
    return {{"binned", "scalar",
             [](const Topology& topology, std::span<const vec3> positions, int threads) {
                 return build_bvh(topology, positions, {.threads = threads});
             }}};
}

}  // namespace mray::bench
