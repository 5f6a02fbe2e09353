#include "lab/bench/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "lab/methods/tracers.h"
#include "report/shell.h"

namespace mray::lab {
namespace {

const std::vector<std::string> kTraced = {"primary", "shadow", "diffuse", "ao", "one-ray"};
const std::vector<std::string> kWorks = {"primary", "shadow", "diffuse", "ao",    "one-ray",
                                         "refit",   "build",  "queries", "frame", "views"};

std::string check_size(const std::string& text) {
    return std::stoul(text) % kTileSize == 0 ? "" : fmt::format("not a multiple of {}", kTileSize);
}

}  // namespace

bool BenchOptions::wants(const std::string& work) const {
    return std::find(works.begin(), works.end(), work) != works.end();
}

int bench_main(BenchProgram program, int argc, const char* const* argv,
               int (*run)(const BenchOptions& options)) {
    BenchOptions o;
    o.line = shell_line(std::vector<std::string>(argv + 1, argv + argc));
    std::uint32_t size = o.view.width;
    const bool is_run = program == BenchProgram::kRun;
    CLI::App app(is_run
                     ? "Measures morphray side by side with Embree on each SCENE, or on built-in "
                       "scenes."
                     : "Traces works of the benchmark by two builds in one process, in turn.",
                 is_run ? "lab/bench/run" : "morphray_compare_builds");
    app.option_defaults()->always_capture_default();
    const auto list = [](CLI::Option* option) {
        return option->delimiter(',')->allow_extra_args(false);
    };
    if (is_run) {
        app.add_option("--csv", o.csv, "the rows as comma-separated values");
        list(app.add_option("--threads", o.threads, "how many threads"))
            ->check(CLI::Range(1, 1024));
        app.add_option("--size", size, "images of as many pixels a side")
            ->check(CLI::Range(1, 16384))
            ->check(check_size);
    } else {
        o.works = kTraced;
        app.add_option("THIS", o.this_build, "the shared object of a build")->required();
        app.add_option("OTHER", o.other_build, "that of the build to compare with")->required();
        list(app.add_option("--simd", o.simd, "instruction sets"));
    }
    app.add_option("SCENE", o.scenes,
                   "a mesh file, a folder or pattern of them, builtin:NAME[:TRIANGLES]");
    app.add_option("--repeat", o.repeat, "rounds, of which medians and least times are taken")
        ->check(CLI::Range(1, 10000));
    list(app.add_option("--work", o.works, "what is measured"))
        ->check(CLI::IsMember(is_run ? kWorks : kTraced));
    try {
        app.parse(argc, argv);
        o.view.width = o.view.height = size;
        return run(o);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}: {}\n", app.get_name(), error.what());
        return 2;
    }
}

}  // namespace mray::lab
