#include "lab/bench/two_builds/build_functions.h"

#include <fmt/format.h>

#include <cstring>
#include <memory>
#include <utility>

#include "common/base/errors.h"
#include "common/base/thread_arena.h"
#include "common/version.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/ours.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {
namespace {

// As short as the parts of ./lab/bench/run.
constexpr std::size_t kParts = 16;

/// A scene and what the rays of its works are made from.
struct OpenScene {
    explicit OpenScene(const std::string& spec)
        : name(spec),
          scene(open_bench_scene(spec, ViewSpec())),
          rays(arena.execute([&] { return SceneRays(scene); })) {}

    TraceWork work(const std::string& work) const {
        for (const WorkKind kind : kAllWorks)
            if (work == name_of(kind)) return rays.work(kind);
        throw Error(ErrorKind::kBadArgument, fmt::format("{}: no such work", work));
    }

    std::string name;
    ThreadArena arena{1};
    BenchScene scene;
    SceneRays rays;
};

/// What a work is traced with.
struct OpenWork {
    std::shared_ptr<OpenScene> scene;
    TraceWork work;
    Tracer tracer = {};
    std::vector<WorkPart> parts = work.parts(kParts);
};

BuiltWork built(const std::shared_ptr<OpenWork>& open) {
    const TraceWork& work = open->work;
    const std::size_t size = work.any_hit() ? 1 : sizeof(Hit);
    const auto trace_part = [open](std::size_t part) {
        open->scene->arena.execute([&] { open->tracer.trace(open->parts[part]); });
    };
    const auto answers = [open, &work, size] {
        const TraceAnswers traced = open->tracer.answers();
        std::vector<unsigned char> bytes(size * work.rays.size());
        for (std::size_t i = 0; i < work.rays.size(); ++i) {
            if (work.active[i] == 0) continue;
            const void* const answer =
                work.any_hit() ? static_cast<const void*>(&traced.occluded[i]) : &traced.hits[i];
            std::memcpy(&bytes[i * size], answer, size);
        }
        return bytes;
    };
    return {work.active_count, open->parts.size(), size, trace_part, answers};
}

BuiltWork open(const std::string& spec, const std::string& work, const std::string& tracer_name,
               const std::string& simd) {
    // The scene that was opened last, since works of one scene are opened one after the other.
    static std::shared_ptr<OpenScene> scene;
    if (scene == nullptr || scene->name != spec) scene = std::make_shared<OpenScene>(spec);
    const std::shared_ptr<OpenWork> opened(new OpenWork{scene, scene->work(work)});
    for (Tracer& tracer : our_tracers(scene->scene.bvh, find_simd_target(simd), opened->work)) {
        if (tracer.name != tracer_name) continue;
        opened->tracer = std::move(tracer);
        return built(opened);
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
