#include <fmt/format.h>

#include <cstdio>
#include <vector>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/shell.h"
#include "common/version.h"
#include "lab/bench/machine.h"
#include "lab/bench/options.h"
#include "lab/bench/report.h"
#include "lab/bench/works/ours.h"
#include "lab/bench/works/works.h"

namespace mray::bench {
namespace {

// As many rays of ambient occlusion as an image has pixels: with more of a pixel, fewer pixels have
// any. So each work takes about as long.
std::size_t most_rays(const BenchScene& scene) {
    return std::size_t{scene.params.width} * scene.params.height;
}

/// The rays of a scene, made before anything is timed. Kinds that no chosen work needs are missing.
struct SceneWorks {
    TraceWork primary;
    std::vector<TraceWork> traced;
};

SceneWorks make_works(const BenchScene& scene, const BenchOptions& options) {
    SceneWorks works{make_primary_work(scene.params), {}};
    if (options.wants("one-ray")) works.traced.push_back(make_row_work(scene.params));
    if (!options.wants("shadow") && !options.wants("diffuse") && !options.wants("ao")) return works;
    const AlignedVector<Hit> hits = reference_hits(scene.bvh, works.primary);
    const auto secondary = [&](WorkKind kind, auto... more) {
        return make_secondary_work(works.primary, hits, scene.mesh(), kind, more...);
    };
    if (options.wants("shadow")) works.traced.push_back(secondary(WorkKind::kShadow));
    if (options.wants("diffuse")) works.traced.push_back(secondary(WorkKind::kDiffuse));
    if (options.wants("ao")) {
        for (const std::uint32_t samples : options.ao_samples)
            works.traced.push_back(secondary(WorkKind::kAo, samples, most_rays(scene)));
    }
    return works;
}

/// The works that are compared with Embree's tracers.
void run_traced_works(const Rig& rig, const BenchScene& scene, const SceneWorks& works,
                      const BenchOptions& options) {
    std::vector<const TraceWork*> traced;
    if (options.wants("primary")) traced.push_back(&works.primary);
    for (const TraceWork& work : works.traced) traced.push_back(&work);
    if (traced.empty()) return;
    const EmbreeScenes embree(rig.devices, scene);
    for (const TraceWork* work : traced) bench_trace(rig, scene, embree, *work);
}

void run_works(const Rig& rig, const BenchScene& scene, const SceneWorks& works,
               const BenchOptions& options) {
    run_traced_works(rig, scene, works, options);
    if (options.wants("queries")) bench_queries(rig, scene);
    if (options.wants("frame")) bench_frame(rig, scene, works.primary);
    if (options.wants("refit")) bench_refit(rig, scene, works.primary);
    if (options.wants("build")) bench_build(rig, scene, works.primary);
}

/// The shell command that repeats this run.
std::string command_line(std::span<const std::string> arguments) {
    return arguments.empty() ? "./lab/bench/run" : "./lab/bench/run " + shell_line(arguments);
}

void run(std::span<const std::string> arguments) {
    const BenchOptions options = parse_options(arguments);
    if (options.help) {
        fmt::print("{}", usage());
        return;
    }
    if (!options.csv.empty()) check_writable(options.csv);
    const ReportHead head{machine_name(),
                          machine_isa(),
                          EmbreeDevice::version(),
                          EmbreeDevice::left_out(),
                          std::string(kVersionDetail),
                          command_line(arguments)};
    if (!head.left_out.empty())
        fmt::print("Embree {} has no {}: they are left out\n", head.embree, head.left_out);
    std::vector<Row> rows;
    // Files are written with each row, so that a run that is ended leaves what it has measured.
    const auto report = [&](const Row& row) {
        rows.push_back(row);
        fmt::print("{}", table_line(row));
        std::fflush(stdout);
        if (!options.csv.empty()) write_file(options.csv, to_csv(head, rows));
    };
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view_kind, options.view);
        fmt::print("{}", table_header());
        const SceneWorks works = make_works(scene, options);
        for (const int threads : options.threads) {
            const std::vector<EmbreeDevice> devices = embree_devices(threads, options.embree);
            run_works({devices, threads, options.repeat, options.targets, report}, scene, works,
                      options);
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
