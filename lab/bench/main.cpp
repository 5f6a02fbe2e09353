#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "common/base/errors.h"
#include "common/report/shell.h"
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

void run(std::span<const std::string> arguments) {
    const BenchOptions options = parse_options(arguments);
    if (!options.help.empty()) {
        fmt::print("{}", options.help);
        return;
    }
    Report report(
        fmt::format("# {}, {}; morphray {}, Embree {}\n# ./lab/bench/run {}\n", machine_name(),
                    machine_isa(), kVersionDetail, EmbreeDevice::version(), shell_line(arguments)),
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
}

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    try {
        mray::bench::run(std::vector<std::string>(argv + 1, argv + argc));
        return 0;
    } catch (const mray::Error& error) {
        fmt::print(stderr, "morphray_bench: {}\n", error.what());
        return error.kind() == mray::ErrorKind::kBadArgument ? 2 : 1;
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_bench: {}\n", error.what());
        return 1;
    }
}
