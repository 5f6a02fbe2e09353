#include "bench/ours.h"

#include "common/bvh_builder.h"
#include "cpu/refit.h"
#include "cpu/scalar_tracer.h"

namespace morphray::bench {
namespace {

/// For tracers with intersect(ray) and occluded(ray), of any rays.
template <class Tracer>
OurTracer ray_by_ray(std::string name, std::string target, Tracer tracer) {
    const auto trace = [tracer](const TraceWork& work, TraceAnswers& answers) {
        for_each_tile(work, [&](const TileRays& tile) {
            for (std::size_t i = tile.begin; i < tile.end; ++i) {
                const Ray& ray = work.rays[i];
                if (!is_active(ray)) continue;
                if (work.any_hit()) {
                    answers.occluded[i] = tracer.occluded(ray);
                } else {
                    answers.hits[i] = tracer.intersect(ray);
                }
            }
        });
    };
    return {std::move(name), std::move(target), {kRaysPrimary, kRaysShadow, kRaysAo}, trace, {}};
}

}  // namespace

std::vector<OurTracer> our_tracers(const TracedScene& scene) {
    return {ray_by_ray("single", "scalar", cpu::ScalarTracer(scene.bvh))};
}

std::vector<Hit> reference_hits(const Bvh& bvh, const TraceWork& work) {
    TraceAnswers answers(work);
    ray_by_ray("single", "scalar", cpu::ScalarTracer(bvh)).trace(work, answers);
    return std::move(answers.hits);
}

std::vector<OurRefit> our_refits() {
    return {{"levels", "scalar",
             [](Bvh& bvh, std::span<const vec3> positions) { cpu::refit(bvh, positions); }}};
}

std::vector<OurBuild> our_builds() {
    return {{"binned", "scalar",
             [](const Topology& topology, std::span<const vec3> positions, int threads) {
                 return build_bvh(topology, positions, {.threads = threads});
             }}};
}

}  // namespace morphray::bench
