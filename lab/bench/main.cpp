#include <fmt/format.h>

#include <vector>

#include "common/version.h"
#include "lab/bench/options.h"
#include "lab/bench/works.h"

namespace mray::bench {
namespace {

void run_works(const Rig& rig, const BenchScene& scene, const SceneRays& rays,
               std::span<const TraceWork> traced, const BenchOptions& options) {
    if (!traced.empty()) {
        const EmbreeScenes embree(rig.devices, scene);
        for (const TraceWork& work : traced) bench_trace(rig, scene, embree, work);
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
                    embree::kHasStreams ? "" : ", which has no streams", options.line),
        options.csv);
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view);
        // All rays are made before anything is timed.
        const SceneRays rays(scene);
        std::vector<TraceWork> traced;
        for (const WorkKind kind : kAllWorks)
            if (options.wants(name_of(kind))) traced.push_back(rays.work(kind));
        for (const int threads : options.threads) {
            const std::vector<EmbreeDevice> devices = embree_devices(threads);
            report.begin(spec, threads);
            run_works({devices, threads, options.repeat, report}, scene, rays, traced, options);
        }
    }
    return 0;
}

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    using namespace mray::bench;
    return bench_main(BenchProgram::kRun, argc, argv, run);
}
