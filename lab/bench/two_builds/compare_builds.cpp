// Traces the works of the benchmark by two builds of this project in one process, in turn.
#include <dlfcn.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/simd/simd_target.h"
#include "lab/bench/interleave.h"
#include "lab/bench/report.h"
#include "lab/bench/two_builds/build_functions.h"

namespace mray::bench {
namespace {

struct CompareOptions {
    /// The shared objects.
    std::string this_build, other_build;
    /// Names of works, scenes and instruction sets are left to the builds.
    std::vector<std::string> scenes = {"builtin:spikes:70000", "builtin:cloth:180000",
                                       "builtin:herd:1000000", "builtin:hall"};
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao", "one-ray"};
    std::vector<std::string> simd = {best_simd_target().name};
    int repeat = 7;
};

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
}

/// Loads a build. It stays loaded, because TBB's threads may run its code to the end of the
/// process.
const BuildFunctions& load_build(const std::string& file) {
    void* const object = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (object == nullptr) throw Error(ErrorKind::kUnavailable, dlerror());
    void* const symbol = dlsym(object, kBuildSymbol);
    if (symbol == nullptr) throw Error(ErrorKind::kUnavailable, dlerror());
    const BuildFunctions& build = *reinterpret_cast<const BuildFunctions* (*)()>(symbol)();
    if (build.interface != kBuildInterface) {
        throw Error(ErrorKind::kUnavailable,
                    fmt::format("{}: interface {}, but this program has {}", file, build.interface,
                                kBuildInterface));
    }
    return build;
}

/// How many answers differ in a bit. Works with different rays differ in all.
std::uint64_t count_differences(const BuiltWork& a, const BuiltWork& b) {
    const std::vector<unsigned char> x = a.answers();
    const std::vector<unsigned char> y = b.answers();
    const std::size_t size = a.answer_size;
    if (x.size() != y.size()) return x.size() / size;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < x.size(); i += size)
        count += std::memcmp(&x[i], &y[i], size) != 0 ? 1 : 0;
    return count;
}

/// Traces a work by both builds and prints a row. Returns how many answers differ.
std::uint64_t compare(const BuildFunctions& ours, const BuildFunctions& theirs,
                      const std::string& scene, const std::string& work, const std::string& tracer,
                      const std::string& simd, int repeat) {
    const BuiltWork a = ours.open(scene, work, tracer, simd);
    const BuiltWork b = theirs.open(scene, work, tracer, simd);
    if (!a.trace_part || !b.trace_part) return 0;
    std::vector<Method> methods;
    for (const BuiltWork* const built : {&a, &b}) {
        methods.push_back({"", {}, [built](std::size_t part) {
                               return timed([&] { built->trace_part(part); });
                           }});
    }
    const std::vector<Times> times = time_in_turn(methods, std::min(a.parts, b.parts), repeat);
    const std::uint64_t differences = count_differences(a, b);
    const Ratio ratio = ratio_of(times[0], times[1]);
    const double krays = 1e-3 * static_cast<double>(a.rays);
    fmt::print("{},{},{},{},{:.2f},{:.2f},{:.3f},{:.3f},{:.3f},{:.3f},{}\n", scene, work, tracer,
               simd, krays / times[0].least_ms, krays / times[1].least_ms, ratio.median,
               ratio.least, ratio.min, ratio.max, differences);
    std::fflush(stdout);
    return differences;
}

/// Returns 1 if an answer differs, else 0.
int run(const CompareOptions& options) {
    const BuildFunctions& ours = load_build(options.this_build);
    const BuildFunctions& theirs = load_build(options.other_build);
    fmt::print(
        "# {}, {}; this {}, other {}; Mray/s at best; ratio above 1: this build is faster\n"
        "scene,work,tracer,simd,this,other,ratio,ratio_at_best,min,max,differences\n",
        machine_name(), machine_isa(), ours.version, theirs.version);
    std::uint64_t differences = 0;
    for (const std::string& scene : options.scenes) {
        for (const std::string& work : options.works) {
            for (const char* const tracer : {"packet", "stream", "single"}) {
                for (const std::string& simd : options.simd)
                    differences += compare(ours, theirs, scene, work, tracer, simd, options.repeat);
            }
        }
    }
    return differences == 0 ? 0 : 1;
}

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    mray::bench::CompareOptions options;
    CLI::App app("Traces works of the benchmark by two builds in one process, in turn.",
                 "morphray_compare_builds");
    add_options(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    try {
        return mray::bench::run(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_compare_builds: {}\n", error.what());
        return 2;
    }
}
