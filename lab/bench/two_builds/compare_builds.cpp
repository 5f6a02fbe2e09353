// Traces the works of the benchmark by two builds of this project in one process, in turn.
#include <dlfcn.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
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
#include "lab/bench/machine.h"
#include "lab/bench/two_builds/build_functions.h"

namespace mray::bench {
namespace {

struct CompareOptions {
    /// The shared objects.
    std::string this_build, other_build;
    std::vector<std::string> scenes = {"builtin:spikes:70000", "builtin:cloth:180000",
                                       "builtin:herd:1000000", "builtin:hall"};
    std::vector<std::string> works = {"primary", "shadow", "diffuse", "ao", "one-ray"};
    std::vector<std::string> simd = {best_simd_target().name};
    int repeat = 7;
    std::uint32_t flush_mib = 0;
    std::string csv;
    /// The text that --help asks for, else empty.
    std::string help;
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
    app.add_option("--flush", options.flush_mib,
                   "MiB that are written before each round, to empty the caches")
        ->check(CLI::Range(0, 65536))
        ->capture_default_str();
    app.add_option("--csv", options.csv, "the rows as comma-separated values");
}

/// Names of works, scenes and instruction sets are left to the builds.
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

constexpr const char* kTracers[] = {"packet", "stream", "single"};
constexpr std::size_t kColumns = 11;
using Line = std::array<std::string, kColumns>;
const Line kHeader = {"scene", "work",          "tracer", "simd", "this",       "other",
                      "ratio", "ratio_at_best", "min",    "max",  "differences"};

/// Lines are shown as they are measured, so their widths are fixed.
std::string line_text(const Line& line) {
    return fmt::format(
        "{:<24}  {:<7}  {:<6}  {:<6}  {:>8}  {:>8}  {:>6}  {:>13}  {:>6}  {:>6}  {:>11}\n", line[0],
        line[1], line[2], line[3], line[4], line[5], line[6], line[7], line[8], line[9], line[10]);
}

/// A work that one build has opened.
class OpenWork {
public:
    OpenWork(const BuildFunctions& build, BuiltWork* work)
        : build_(&build), work_(work, build.close) {}

    explicit operator bool() const { return work_ != nullptr; }
    std::size_t rays() const { return build_->rays(work_.get()); }
    std::size_t parts() const { return build_->parts(work_.get()); }
    void trace_part(std::size_t part) const { build_->trace_part(work_.get(), part); }

    struct Answers {
        const unsigned char* bytes;
        std::size_t size;
        std::size_t count;
    };
    Answers answers() const {
        Answers answers{};
        answers.bytes = build_->answers(work_.get(), &answers.size, &answers.count);
        return answers;
    }

private:
    const BuildFunctions* build_;
    std::unique_ptr<BuiltWork, void (*)(BuiltWork*)> work_;
};

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

OpenWork open_work(const BuildFunctions& build, const std::string& scene, const std::string& work,
                   const std::string& tracer, const std::string& simd) {
    std::array<char, 1024> error{};
    OpenWork opened(build, build.open(scene.c_str(), work.c_str(), tracer.c_str(), simd.c_str(),
                                      error.data(), error.size()));
    if (error[0] != '\0') throw Error(ErrorKind::kBadArgument, error.data());
    return opened;
}

/// How many answers differ in a bit. Works with different rays differ in all.
std::uint64_t count_differences(const OpenWork& a, const OpenWork& b) {
    const OpenWork::Answers x = a.answers();
    const OpenWork::Answers y = b.answers();
    if (x.size != y.size || x.count != y.count) return x.count;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < x.count * x.size; i += x.size)
        count += std::memcmp(x.bytes + i, y.bytes + i, x.size) != 0 ? 1 : 0;
    return count;
}

class Comparison {
public:
    explicit Comparison(const CompareOptions& options)
        : options_(options),
          this_(load_build(options.this_build)),
          other_(load_build(options.other_build)),
          flushed_(std::size_t{options.flush_mib} << 20) {}

    void measure(const std::string& scene, const std::string& work, const std::string& tracer,
                 const std::string& simd) {
        const OpenWork ours = open_work(this_, scene, work, tracer, simd);
        const OpenWork theirs = open_work(other_, scene, work, tracer, simd);
        if (!ours || !theirs) return;
        const PartMethod methods[] = {method_of(ours), method_of(theirs)};
        const std::vector<Times> times =
            time_parts(methods, std::min(ours.parts(), theirs.parts()), options_.repeat);
        const std::uint64_t differences = count_differences(ours, theirs);
        all_differences_ += differences;
        const Ratio ratio = ratio_of(times[0], times[1]);
        const auto speed = [&](const Times& time) {
            return fmt::format("{:.2f}", static_cast<double>(ours.rays()) / time.least_ms * 1e-3);
        };
        const auto text = [](double value) { return fmt::format("{:.3f}", value); };
        const Line line = {scene,
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
        fmt::print("{}", line_text(line));
        std::fflush(stdout);
        table_.add({line.begin(), line.end()});
    }

    std::string csv(std::span<const std::string> options) const {
        return fmt::format("# {}, {}; this {}, other {}\n# ./lab/bench/builds OTHER {}\n{}",
                           machine_name(), machine_isa(), this_.version, other_.version,
                           shell_line(options), table_.csv());
    }
    std::uint64_t all_differences() const { return all_differences_; }

private:
    PartMethod method_of(const OpenWork& work) {
        return {"", [this] { flush(); }, [&work](std::size_t part) { work.trace_part(part); }};
    }

    void flush() {
        for (std::size_t i = 0; i < flushed_.size(); i += 64) ++flushed_[i];
    }

    const CompareOptions& options_;
    const BuildFunctions& this_;
    const BuildFunctions& other_;
    std::vector<unsigned char> flushed_;
    Table table_{{kHeader.begin(), kHeader.end()}};
    std::uint64_t all_differences_ = 0;
};

/// Returns 1 if an answer differs, else 0.
int run(std::span<const std::string> arguments) {
    const CompareOptions options = parse_compare_options(arguments);
    if (!options.help.empty()) {
        fmt::print("{}", options.help);
        return 0;
    }
    if (!options.csv.empty()) check_writable(options.csv);
    Comparison comparison(options);
    fmt::print("Mray/s at best; ratio above 1: this build is faster\n{}", line_text(kHeader));
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
        write_file(options.csv, comparison.csv(arguments.subspan(2)));
    }
    return comparison.all_differences() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace mray::bench

int main(int argc, char** argv) {
    try {
        return mray::bench::run(std::vector<std::string>(argv + 1, argv + argc));
    } catch (const std::exception& error) {
        fmt::print(stderr, "morphray_compare_builds: {}\n", error.what());
        return 2;
    }
}
