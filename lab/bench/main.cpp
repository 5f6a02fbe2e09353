#include <fmt/format.h>

#include <vector>

#include "common/version.h"
#include "lab/bench/options.h"
#include "lab/bench/works.h"

namespace mray::lab {
namespace {

void run_works(const Rig& rig, const BenchScene& scene, const SceneRays& rays,
               std::span<const RaySet> traced, const BenchOptions& options) {
    if (!traced.empty()) {
        const std::vector<EmbreeVariant> embree =
            embree_variants(rig.devices, scene.topology(), scene.positions);
        for (const RaySet& set : traced) bench_trace(rig, scene, embree, set);
    }
    if (options.wants("queries")) bench_queries(rig, scene);
    if (options.wants("frame")) bench_frame(rig, scene, rays.primary());
    if (options.wants("refit")) bench_refit(rig, scene, rays.primary());
    if (options.wants("build")) bench_build(rig, scene, rays.primary());
}

int run(const BenchOptions& options) {
    Report report(
        fmt::format("# {}, {}; morphray {}, Embree {}{}\n# ./lab/bench/run {}\n", machine_name(),
                    best_simd_target().name, kVersionDetail, RTC_VERSION_STRING,
                    kEmbreeHasStreams ? "" : ", which has no streams", options.line),
        options.csv);
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view);
        // All rays are made before anything is timed.
        const SceneRays rays(scene);
        std::vector<RaySet> traced;
        for (const RayKind kind : kAllKinds)
            if (options.wants(name_of(kind))) traced.push_back(rays.rays(kind));
        for (const int threads : options.threads) {
            const std::vector<EmbreeDevice> devices = embree_devices(threads);
            report.begin(spec, threads);
            ThreadArena arena(threads);
            run_works({devices, arena, options.repeat, report}, scene, rays, traced, options);
        }
    }
    return 0;
}

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    using namespace mray::lab;
    return bench_main(BenchProgram::kRun, argc, argv, run);
}
