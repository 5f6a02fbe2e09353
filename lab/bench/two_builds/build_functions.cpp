#include "lab/bench/two_builds/build_functions.h"

#include <algorithm>
#include <cstring>
#include <memory>

#include "common/base/thread_arena.h"
#include "common/version.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/options.h"
#include "lab/methods/tracers.h"

namespace mray::lab {
namespace {

// As short as the parts of ./lab/bench/run.
constexpr std::size_t kParts = 16;

/// The bytes of all answers to the rays of a set; 0 where it has no rays.
std::vector<unsigned char> bytes_of(const RaySet& set, const TraceAnswers& traced,
                                    std::size_t size) {
    std::vector<unsigned char> bytes(size * set.rays.size());
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        if (set.active[i] == 0) continue;
        const void* const answer =
            set.any_hit() ? static_cast<const void*>(&traced.occluded[i]) : &traced.hits[i];
        std::memcpy(&bytes[i * size], answer, size);
    }
    return bytes;
}

BuiltTracer open(const std::string& spec, const std::string& work, const std::string& tracer_name,
                 const std::string& simd) {
    static ThreadArena arena(1);
    // The scene that was opened last, since works of one scene are opened one after the other.
    static std::shared_ptr<const BenchScene> scene;
    if (scene == nullptr || scene->name != spec)
        scene = std::make_shared<BenchScene>(open_bench_scene(spec, BenchOptions().size));
    const auto kind = std::ranges::find(kAllKinds, work, name_of);
    const auto set = std::make_shared<const RaySet>(scene->rays(*kind));
    for (const Tracer& tracer : our_tracers(scene->bvh, find_simd_target(simd), *set)) {
        if (tracer.name != tracer_name) continue;
        const std::vector<TileRange> parts = set->ranges(kParts);
        const std::size_t size = set->any_hit() ? 1 : sizeof(Hit);
        return {set->active_count, parts.size(), size,
                [opened = scene, set, tracer, parts](std::size_t part) {
                    arena.execute([&] { tracer.trace(parts[part]); });
                },
                [set, tracer, size] { return bytes_of(*set, tracer.answers(), size); }};
    }
    return {};
}

}  // namespace
}  // namespace mray::lab

extern "C" __attribute__((visibility("default"))) const mray::lab::BuildFunctions*
morphray_build_functions() {
    using namespace mray::lab;
    static constexpr BuildFunctions kFunctions = {kBuildInterface, mray::kVersionDetail.data(),
                                                  open};
    return &kFunctions;
}
