// Traces the works of the benchmark by two builds of this project in one process, in turn.
#include <dlfcn.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/report/shell.h"
#include "common/report/table.h"
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
    std::string csv;
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
    app.add_option("--csv", options.csv, "the rows as comma-separated values");
}

constexpr const char* kTracers[] = {"packet", "stream", "single"};
/// Lines are shown as they are measured, so their widths are fixed.
const Column kColumns[] = {
    {"scene", 24, false}, {"work", 7, false}, {"tracer", 6, false}, {"simd", 6, false},
    {"this", 8},          {"other", 8},       {"ratio", 6},         {"ratio_at_best", 13},
    {"min", 6},           {"max", 6},         {"differences", 11},
};

std::vector<std::string> column_names() {
    std::vector<std::string> names;
    for (const Column& column : kColumns) names.push_back(column.name);
    return names;
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
    const std::size_t size = a.answer_size();
    if (x.size() != y.size()) return x.size() / size;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < x.size(); i += size)
        count += std::memcmp(&x[i], &y[i], size) != 0 ? 1 : 0;
    return count;
}

class Comparison {
public:
    Comparison(const BuildFunctions& ours, const BuildFunctions& theirs, int repeat)
        : this_(ours), other_(theirs), repeat_(repeat) {}

    void measure(const std::string& scene, const std::string& work, const std::string& tracer,
                 const std::string& simd) {
        const std::unique_ptr<BuiltWork> ours = this_.open(scene, work, tracer, simd);
        const std::unique_ptr<BuiltWork> theirs = other_.open(scene, work, tracer, simd);
        if (!ours || !theirs) return;
        std::vector<Method> methods;
        for (BuiltWork* const built : {ours.get(), theirs.get()}) {
            methods.push_back({"", {}, [built](std::size_t part) {
                                   return timed([&] { built->trace_part(part); });
                               }});
        }
        const std::vector<Times> times =
            time_in_turn(methods, std::min(ours->parts(), theirs->parts()), repeat_);
        const std::uint64_t differences = count_differences(*ours, *theirs);
        all_differences_ += differences;
        const Ratio ratio = ratio_of(times[0], times[1]);
        const auto speed = [&](const Times& time) {
            return fmt::format("{:.2f}", static_cast<double>(ours->rays()) / time.least_ms * 1e-3);
        };
        const auto text = [](double value) { return fmt::format("{:.3f}", value); };
        const std::vector<std::string> line = {scene,
                                               work,
                                               tracer,
                                               simd,
                                               speed(times[0]),
                                               speed(times[1]),
                                               text(ratio.median),
                                               text(ratio.least),
                                               text(ratio.min),
                                               text(ratio.max),
                                               std::to_string(differences)};
        fmt::print("{}", row_text(kColumns, line));
        std::fflush(stdout);
        table_.add(line);
    }

    std::string csv() const { return table_.csv(); }
    std::uint64_t all_differences() const { return all_differences_; }

private:
    const BuildFunctions& this_;
    const BuildFunctions& other_;
    int repeat_;
    Table table_{column_names()};
    std::uint64_t all_differences_ = 0;
};

/// Returns 1 if an answer differs, else 0.
int run(const CompareOptions& options, std::span<const std::string> arguments) {
    if (!options.csv.empty()) check_writable(options.csv);
    const BuildFunctions& ours = load_build(options.this_build);
    const BuildFunctions& theirs = load_build(options.other_build);
    Comparison comparison(ours, theirs, options.repeat);
    fmt::print("Mray/s at best; ratio above 1: this build is faster\n{}", header_text(kColumns));
    for (const std::string& scene : options.scenes) {
        for (const std::string& work : options.works) {
            for (const char* const tracer : kTracers) {
                for (const std::string& simd : options.simd)
                    comparison.measure(scene, work, tracer, simd);
            }
        }
    }
    if (!options.csv.empty()) {
        // lab/bench/builds puts the shared objects first.
        write_file(options.csv,
                   fmt::format("# {}, {}; this {}, other {}\n# ./lab/bench/builds OTHER {}\n{}",
                               machine_name(), machine_isa(), ours.version, theirs.version,
                               shell_line(arguments.subspan(2)), comparison.csv()));
    }
    return comparison.all_differences() == 0 ? 0 : 1;
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
        return mray::bench::run(options, std::vector<std::string>(argv + 1, argv + argc));
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_compare_builds: {}\n", error.what());
        return 2;
    }
}
