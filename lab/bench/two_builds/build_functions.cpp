#include "lab/bench/two_builds/build_functions.h"

#include <fmt/format.h>

#include <cstring>
#include <memory>

#include "common/base/errors.h"
#include "common/base/thread_arena.h"
#include "common/version.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {
namespace {

// As short as the parts of ./lab/bench/run.
constexpr std::size_t kParts = 16;

struct OpenScene {
    explicit OpenScene(const std::string& spec)
        : scene(open_bench_scene(spec, ViewSpec())),
          rays(arena.execute([&] { return SceneRays(scene); })) {}

    TraceWork work(const std::string& work) const {
        for (const WorkKind kind : kAllWorks)
            if (work == name_of(kind)) return rays.work(kind);
        throw Error(ErrorKind::kBadArgument, "{}: no such work", work);
    }

    ThreadArena arena{1};
    BenchScene scene;
    SceneRays rays;
};

/// The bytes of all answers to the rays of a work; 0 for those that it does not have.
std::vector<unsigned char> bytes_of(const TraceWork& work, const TraceAnswers& traced,
                                    std::size_t size) {
    std::vector<unsigned char> bytes(size * work.rays.size());
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        if (work.active[i] == 0) continue;
        const void* const answer =
            work.any_hit() ? static_cast<const void*>(&traced.occluded[i]) : &traced.hits[i];
        std::memcpy(&bytes[i * size], answer, size);
    }
    return bytes;
}

BuiltWork open(const std::string& spec, const std::string& work_name,
               const std::string& tracer_name, const std::string& simd) {
    // The scene that was opened last, since works of one scene are opened one after the other.
    static std::shared_ptr<OpenScene> scene;
    if (scene == nullptr || scene->scene.name != spec) scene = std::make_shared<OpenScene>(spec);
    const auto work = std::make_shared<const TraceWork>(scene->work(work_name));
    for (const Tracer& tracer : our_tracers(scene->scene.bvh, find_simd_target(simd), *work)) {
        if (tracer.name != tracer_name) continue;
        const std::vector<WorkPart> parts = work->parts(kParts);
        const std::size_t size = work->any_hit() ? 1 : sizeof(Hit);
        return {work->active_count, parts.size(), size,
                [opened = scene, work, tracer, parts](std::size_t part) {
                    opened->arena.execute([&] { tracer.trace(parts[part]); });
                },
                [work, tracer, size] { return bytes_of(*work, tracer.answers(), size); }};
    }
    return {};
}

}  // namespace
}  // namespace mray::bench

extern "C" __attribute__((visibility("default"))) const mray::bench::BuildFunctions*
morphray_build_functions() {
    using namespace mray::bench;
    static constexpr BuildFunctions kFunctions = {kBuildInterface, mray::kVersionDetail.data(),
                                                  open};
    return &kFunctions;
}
