// morphray_bench PROGRAM OPTIONS: the benchmark's programs on one command line. lab/bench/run
// starts `run`, lab/bench/gpu/check `device`, lab/bench/builds `builds`.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "lab/bench/options.h"
#include "lab/methods/tracers.h"
#include "report/shell.h"

namespace mray::lab {
namespace {

constexpr const char* kAboutRun =
    "Measures morphray side by side with Embree on each SCENE, or on built-in scenes.";

struct Program {
    std::string_view command;
    const char* name;
    const char* about;
    int (*run)(const BenchOptions& options);
};
constexpr Program kPrograms[] = {
    {"builds", "morphray_compare_builds",
     "Traces works of the benchmark by two builds in one process, in turn.", compare_builds},
#ifdef MORPHRAY_EMBREE
    {"run", "lab/bench/run", kAboutRun, bench_beside_embree},
#endif
#ifdef MORPHRAY_HAS_VULKAN
    {"device", "lab/bench/run", kAboutRun, bench_on_device},
#endif
};

const std::vector<std::string> kTraced = {"primary", "shadow", "diffuse", "ao", "one-ray"};
const std::vector<std::string> kWorks = {"primary", "shadow", "diffuse", "ao",    "one-ray",
                                         "refit",   "build",  "queries", "frame", "views"};

std::string check_size(const std::string& text) {
    return std::stoul(text) % kTileSize == 0 ? "" : fmt::format("not a multiple of {}", kTileSize);
}

/// Returns what the program returns; 0 after --help, and 2 after an error.
int run_program(const Program& program, std::vector<std::string> arguments) {
    BenchOptions o;
    o.line = shell_line(arguments);
    std::uint32_t size = o.view.width;
    CLI::App app(program.about, program.name);
    app.option_defaults()->always_capture_default();
    const auto list = [](CLI::Option* option) {
        return option->delimiter(',')->allow_extra_args(false);
    };
    const bool is_builds = program.run == compare_builds;
    if (is_builds) {
        o.works = kTraced;
        app.add_option("THIS", o.this_build, "the shared object of a build")->required();
        app.add_option("OTHER", o.other_build, "that of the build to compare with")->required();
        list(app.add_option("--simd", o.simd, "instruction sets"));
    } else {
        app.add_option("--csv", o.csv, "the rows as comma-separated values");
        list(app.add_option("--threads", o.threads, "how many threads"))
            ->check(CLI::Range(1, 1024));
        app.add_option("--size", size, "images of as many pixels a side")
            ->check(CLI::Range(1, 16384))
            ->check(check_size);
    }
    app.add_option("SCENE", o.scenes,
                   "a mesh file, a folder or pattern of them, builtin:NAME[:TRIANGLES]");
    app.add_option("--repeat", o.repeat, "rounds, of which medians and least times are taken")
        ->check(CLI::Range(1, 10000));
    list(app.add_option("--work", o.works, "what is measured"))
        ->check(CLI::IsMember(is_builds ? kTraced : kWorks));
    try {
        // CLI11 takes them from the end.
        std::ranges::reverse(arguments);
        app.parse(std::move(arguments));
        o.view.width = o.view.height = size;
        return program.run(o);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}: {}\n", app.get_name(), error.what());
        return 2;
    }
}

}  // namespace
}  // namespace mray::lab

int main(int argc, char** argv) {
    using namespace mray::lab;
    for (const Program& program : kPrograms)
        if (argc > 1 && program.command == argv[1])
            return run_program(program, {argv + 2, argv + argc});
    fmt::print(stderr, "morphray_bench: start lab/bench/run or lab/bench/builds instead\n");
    return 2;
}
