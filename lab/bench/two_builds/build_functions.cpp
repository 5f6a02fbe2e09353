#include "lab/bench/two_builds/build_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/base/aligned_vector.h"
#include "common/base/errors.h"
#include "common/base/thread_arena.h"
#include "common/version.h"
#include "lab/bench/bench_scene.h"
#include "lab/bench/trace_work.h"
#include "lab/bench/works/ours.h"

namespace mray::bench {
namespace {

// As short as the parts of ./lab/bench/run.
constexpr std::size_t kParts = 16;
constexpr std::uint32_t kAoSamples = 4;

/// A scene and what the rays of its works are made from.
struct OpenScene {
    explicit OpenScene(const std::string& spec)
        : name(spec),
          scene(open_bench_scene(spec, ViewKind::kFill, ViewSpec())),
          primary(make_primary_work(scene.params)),
          hits(arena.execute([&] { return reference_hits(scene.bvh, primary); })) {}

    TraceWork work(WorkKind kind) const {
        if (kind == WorkKind::kPrimary) return primary;
        if (kind == WorkKind::kOneRay) return make_row_work(scene.params);
        if (kind == WorkKind::kAo) {
            return make_secondary_work(primary, hits, scene.mesh(), kind, kAoSamples,
                                       primary.rays.size());
        }
        return make_secondary_work(primary, hits, scene.mesh(), kind);
    }

    std::string name;
    ThreadArena arena{1};
    BenchScene scene;
    TraceWork primary;
    AlignedVector<Hit> hits;
};

/// The scene that was opened last, since works of one scene are opened one after the other.
std::shared_ptr<OpenScene> open_once(const std::string& spec) {
    static std::shared_ptr<OpenScene> last;
    if (last == nullptr || last->name != spec) last = std::make_shared<OpenScene>(spec);
    return last;
}

WorkKind kind_of(const std::string& work) {
    constexpr std::pair<const char*, WorkKind> kKinds[] = {{"primary", WorkKind::kPrimary},
                                                           {"shadow", WorkKind::kShadow},
                                                           {"diffuse", WorkKind::kDiffuse},
                                                           {"ao", WorkKind::kAo},
                                                           {"one-ray", WorkKind::kOneRay}};
    for (const auto& [name, kind] : kKinds) {
        if (work == name) return kind;
    }
    throw Error(ErrorKind::kBadArgument, fmt::format("{}: no such work", work));
}

}  // namespace

struct BuiltWork {
    std::shared_ptr<OpenScene> scene;
    TraceWork work;
    OurTracer tracer;
    std::vector<WorkPart> parts;
    TraceAnswers answers;
    std::vector<unsigned char> bytes;
};

namespace {

std::unique_ptr<BuiltWork> open_work(const char* spec, const char* work_name,
                                     const std::string& tracer_name, const char* simd) {
    const WorkKind kind = kind_of(work_name);
    const SimdTarget targets[] = {find_simd_target(simd)};
    std::shared_ptr<OpenScene> scene = open_once(spec);
    for (OurTracer& tracer : our_tracers(scene->scene.bvh, targets)) {
        if (tracer.name != tracer_name || std::ranges::count(tracer.works, kind) == 0) continue;
        TraceWork work = scene->work(kind);
        std::vector<WorkPart> parts = work.parts(kParts);
        TraceAnswers answers(work);
        return std::unique_ptr<BuiltWork>(new BuiltWork{std::move(scene),
                                                        std::move(work),
                                                        std::move(tracer),
                                                        std::move(parts),
                                                        std::move(answers),
                                                        {}});
    }
    return nullptr;
}

BuiltWork* open(const char* scene, const char* work, const char* tracer, const char* simd,
                char* error, std::size_t size) {
    const auto fail = [&](const char* message) {
        const std::size_t length = std::min(std::strlen(message), size - 1);
        std::memcpy(error, message, length);
        error[length] = '\0';
    };
    fail("");
    try {
        return open_work(scene, work, tracer, simd).release();
    } catch (const std::exception& exception) {
        fail(exception.what());
        return nullptr;
    }
}

void close(BuiltWork* built) { delete built; }

std::size_t rays(const BuiltWork* built) { return built->work.active_count; }

std::size_t parts(const BuiltWork* built) { return built->parts.size(); }

void trace_part(BuiltWork* built, std::size_t part) {
    built->scene->arena.execute(
        [&] { built->tracer.trace_part(built->work, built->parts[part], built->answers); });
}

const unsigned char* answers(BuiltWork* built, std::size_t* answer_size, std::size_t* count) {
    const TraceWork& work = built->work;
    const bool any_hit = work.any_hit();
    TraceAnswers ordered = built->answers;
    if (built->tracer.in_image_order && !any_hit) to_ray_order(work, ordered.hits);
    *answer_size = any_hit ? 1 : sizeof(Hit);
    *count = work.rays.size();
    built->bytes.assign(*answer_size * *count, 0);
    for (std::size_t i = 0; i < *count; ++i) {
        if (work.active[i] == 0) continue;
        const void* const answer =
            any_hit ? static_cast<const void*>(&ordered.occluded[i]) : &ordered.hits[i];
        std::memcpy(&built->bytes[i * *answer_size], answer, *answer_size);
    }
    return built->bytes.data();
}

}  // namespace
}  // namespace mray::bench

extern "C" __attribute__((visibility("default"))) const mray::bench::BuildFunctions*
morphray_build_functions() {
    using namespace mray::bench;
    static constexpr BuildFunctions kFunctions = {.interface = kBuildInterface,
                                                  .version = mray::kVersionDetail.data(),
                                                  .open = open,
                                                  .close = close,
                                                  .rays = rays,
                                                  .parts = parts,
                                                  .trace_part = trace_part,
                                                  .answers = answers};
    return &kFunctions;
}
