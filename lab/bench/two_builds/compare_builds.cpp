#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "lab/bench/options.h"
#include "lab/bench/two_builds/build_functions.h"
#include "lab/methods/report.h"

namespace mray::lab {
namespace {

/// It stays loaded, because TBB's threads may run its code to the end of the process.
const BuildFunctions& load_build(const std::string& file) {
    void* const object = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const symbol = object == nullptr ? nullptr : dlsym(object, kBuildSymbol);
    if (symbol == nullptr) throw Error(ErrorKind::kUnavailable, dlerror());
    const BuildFunctions& build = *reinterpret_cast<const BuildFunctions* (*)()>(symbol)();
    if (build.interface != kBuildInterface) {
        throw Error(ErrorKind::kUnavailable, "{}: interface {}, but this program has {}", file,
                    build.interface, kBuildInterface);
    }
    return build;
}

/// How many answers differ in a bit. Works with different rays differ in all.
std::uint64_t count_differences(const BuiltTracer& a, const BuiltTracer& b) {
    const std::vector<unsigned char> x = a.answers();
    const std::vector<unsigned char> y = b.answers();
    const std::size_t size = a.answer_size;
    if (x.size() != y.size()) return x.size() / size;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < x.size(); i += size)
        count += std::memcmp(&x[i], &y[i], size) != 0 ? 1 : 0;
    return count;
}

}  // namespace

int compare_builds(const BenchOptions& options) {
    const BuildFunctions& ours = load_build(options.this_build);
    const BuildFunctions& theirs = load_build(options.other_build);
    Report report(fmt::format("# {}; ours is {}\n", machine_name(), ours.version), "");
    std::uint64_t differences = 0;
    const auto compare = [&](const std::string& scene, const std::string& work,
                             const std::string& tracer, const std::string& simd) {
        const BuiltTracer a = ours.open(scene, work, tracer, simd);
        const BuiltTracer b = theirs.open(scene, work, tracer, simd);
        if (!a.trace_part || !b.trace_part) return;
        const auto run = [](const BuiltTracer& built) {
            return [&built](std::size_t part) { return timed([&] { built.trace_part(part); }); };
        };
        const Method methods[] = {{tracer, {}, run(a)},
                                  {fmt::format("{} {}", theirs.version, simd), {}, run(b), "", [&] {
                                       return count_differences(a, b);
                                   }}};
        differences += report.compare({work, kMrayPerSecond, a.rays}, methods,
                                      std::min(a.parts, b.parts), options.repeat);
    };
    for (const std::string& scene : options.scenes) {
        report.begin(scene, 1);
        for (const std::string& work : options.works)
            for (const char* const tracer : {"packet", "stream", "single"})
                for (const std::string& simd : options.simd) compare(scene, work, tracer, simd);
    }
    return differences == 0 ? 0 : 1;
}

}  // namespace mray::lab
