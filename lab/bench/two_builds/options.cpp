#include "lab/bench/two_builds/options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "common/base/errors.h"

namespace mray::bench {
namespace {

void add_options(CLI::App& app, CompareOptions& options) {
    app.add_option("THIS", options.this_build, "the shared object of a build")->required();
    app.add_option("OTHER", options.other_build, "that of the build to compare with")->required();
    app.add_option("SCENE", options.scenes,
                   "a mesh file, a folder or pattern of them, builtin:NAME[:TRIANGLES]");
    app.add_option("--work", options.works, "some of primary, shadow, diffuse, ao, one-ray")
        ->delimiter(',')
        ->allow_extra_args(false);
    app.add_option("--simd", options.simd, "instruction sets (the best one)")
        ->delimiter(',')
        ->allow_extra_args(false);
    app.add_option("--repeat", options.repeat, "rounds after one to warm up")
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
    app.add_option("--flush", options.flush_mib,
                   "MiB that are written before each round, to empty the caches")
        ->check(CLI::Range(0, 65536))
        ->capture_default_str();
    app.add_option("--csv", options.csv, "the rows as comma-separated values");
}

}  // namespace

CompareOptions parse_compare_options(std::span<const std::string> arguments) {
    CompareOptions options;
    CLI::App app("Traces works of the benchmark by two builds in one process, in turn.",
                 "morphray_compare_builds");
    add_options(app, options);
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::CallForHelp&) {
        options.help = app.help();
    } catch (const CLI::ParseError& error) {
        throw Error(ErrorKind::kBadArgument, fmt::format("{}; see --help", error.what()));
    }
    return options;
}

}  // namespace mray::bench
