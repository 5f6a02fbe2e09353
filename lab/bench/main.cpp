#include <fmt/format.h>

#include <cstdio>
#include <vector>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/shell.h"
#include "common/version.h"
#include "lab/bench/options.h"
#include "lab/bench/works.h"

namespace mray::bench {
namespace {

/// The rays of a scene that are traced, made before anything is timed. Kinds that no chosen work
/// needs are missing.
std::vector<TraceWork> make_works(const BenchScene& scene, const TraceWork& primary,
                                  const BenchOptions& options) {
    std::vector<TraceWork> works;
    if (options.wants("primary")) works.push_back(primary);
    if (options.wants("one-ray")) works.push_back(make_row_work(scene.params));
    if (!options.wants("shadow") && !options.wants("diffuse") && !options.wants("ao")) return works;
    const AlignedVector<Hit> hits = reference_hits(scene.bvh, primary);
    const auto add = [&](WorkKind kind, auto... more) {
        works.push_back(make_secondary_work(primary, hits, scene.mesh(), kind, more...));
    };
    if (options.wants("shadow")) add(WorkKind::kShadow);
    if (options.wants("diffuse")) add(WorkKind::kDiffuse);
    if (options.wants("ao")) {
        // As many rays as an image has pixels: with more of a pixel, fewer pixels have any. So each
        // work takes about as long.
        for (const std::uint32_t samples : options.ao_samples)
            add(WorkKind::kAo, samples, primary.rays.size());
    }
    return works;
}

void run_works(const Rig& rig, const BenchScene& scene, const TraceWork& primary,
               const std::vector<TraceWork>& traced, const BenchOptions& options) {
    if (!traced.empty()) {
        const EmbreeScenes embree(rig.devices, scene);
        for (const TraceWork& work : traced) bench_trace(rig, scene, embree, work);
    }
    if (options.wants("queries")) bench_queries(rig, scene);
    if (options.wants("frame")) bench_frame(rig, scene, primary);
    if (options.wants("refit")) bench_refit(rig, scene, primary);
    if (options.wants("build")) bench_build(rig, scene, primary);
}

void run(std::span<const std::string> arguments) {
    const BenchOptions options = parse_options(arguments);
    if (!options.help.empty()) {
        fmt::print("{}", options.help);
        return;
    }
    if (!options.csv.empty()) check_writable(options.csv);
    std::string embree = EmbreeDevice::version();
    if (!EmbreeDevice::left_out().empty())
        embree += fmt::format(", which has no {}", EmbreeDevice::left_out());
    const std::string head =
        fmt::format("# {}, {}; morphray {}, Embree {}\n# ./lab/bench/run {}\n", machine_name(),
                    machine_isa(), kVersionDetail, embree, shell_line(arguments));
    fmt::print("{}", head);
    std::vector<Row> rows;
    // Files are written with each row, so that a run that is ended leaves what it has measured.
    const auto report = [&](const Row& row) {
        rows.push_back(row);
        fmt::print("{}", table_line(row));
        std::fflush(stdout);
        if (!options.csv.empty()) write_file(options.csv, head + to_csv(rows));
    };
    for (const std::string& spec : options.scenes) {
        const BenchScene scene = open_bench_scene(spec, options.view_kind, options.view);
        fmt::print("{}", table_header());
        const TraceWork primary = make_primary_work(scene.params);
        const std::vector<TraceWork> traced = make_works(scene, primary, options);
        for (const int threads : options.threads) {
            const std::vector<EmbreeDevice> devices = embree_devices(threads, options.embree);
            run_works({devices, threads, options.repeat, options.targets, report}, scene, primary,
                      traced, options);
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
