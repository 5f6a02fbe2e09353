// morphray_bench PROGRAM OPTIONS: the benchmark's programs on one command line. lab/bench/run
// starts `run`, lab/bench/gpu/check `device` and `model`, lab/bench/builds `builds`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "lab/bench/options.h"
#include "lab/methods/tracers.h"
#include "report/shell.h"

namespace mray::lab {
namespace {

constexpr const char* kAboutRun =
    "Measures morphray side by side with Embree on each SCENE, or on built-in scenes.";
const std::map<std::string, std::pair<const char*, int (*)(const BenchOptions&)>> kPrograms = {
    {"builds",
     {"Traces works of the benchmark by two builds in one process, in turn.", compare_builds}},
    {"model", {"What kernels would take on a GPU.", model_gpu}},
#ifdef MORPHRAY_EMBREE
    {"run", {kAboutRun, bench_beside_embree}},
#endif
#ifdef MORPHRAY_HAS_VULKAN
    {"device", {kAboutRun, bench_on_device}},
#endif
};

std::string check_size(const std::string& text) {
    return std::stoul(text) % kTileSize == 0 ? "" : fmt::format("not a multiple of {}", kTileSize);
}

void add_options(CLI::App& app, const std::string& program, BenchOptions& o) {
    app.option_defaults()->always_capture_default();
    const auto list = [](CLI::Option* option) {
        return option->delimiter(',')->allow_extra_args(false);
    };
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao", "one-ray"};
    if (program == "builds") {
        o.works = works;
        app.add_option("THIS", o.this_build, "the shared object of a build")->required();
        app.add_option("OTHER", o.other_build, "that of the build to compare with")->required();
        list(app.add_option("--simd", o.simd, "instruction sets"));
    } else {
        app.add_option("--size", o.size, "images of as many pixels a side")
            ->check(CLI::Range(1, 16384))
            ->check(check_size);
    }
    app.add_option("SCENE", o.scenes,
                   "a mesh file, a folder or pattern of them, builtin:NAME[:TRIANGLES]");
    if (program == "model") {
        app.add_option("--card", o.card, "the GPU")
            ->check(CLI::IsMember({"H100", "H200", "RX6800XT"}));
        app.add_option("--distance", o.distance, "the whole scene, by the default eye's distance");
        return;
    }
    if (program != "builds") {
        works.insert(works.end(), {"refit", "build", "queries", "frame", "crossings"});
        app.add_option("--csv", o.csv, "the rows as comma-separated values");
        list(app.add_option("--threads", o.threads, "how many threads"))
            ->check(CLI::Range(1, 1024));
    }
    app.add_option("--repeat", o.repeat, "rounds, of which medians and least times are taken")
        ->check(CLI::Range(1, 10000));
    list(app.add_option("--work", o.works, "what is measured"))->check(CLI::IsMember(works));
}

}  // namespace
}  // namespace mray::lab

/// 0 after --help, 2 after an error.
int main(int argc, char** argv) {
    using namespace mray::lab;
    const auto found = kPrograms.find(argc > 1 ? argv[1] : "");
    if (found == kPrograms.end()) {
        fmt::print(stderr, "morphray_bench: start lab/bench/run or lab/bench/builds instead\n");
        return 2;
    }
    const auto& [about, run] = found->second;
    CLI::App app(about, "morphray_bench " + found->first);
    try {
        BenchOptions o;
        o.line = mray::shell_line(std::vector<std::string>(argv + 2, argv + argc));
        add_options(app, found->first, o);
        app.parse(argc - 1, argv + 1);
        return run(o);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}: {}\n", app.get_name(), error.what());
        return 2;
    }
}
