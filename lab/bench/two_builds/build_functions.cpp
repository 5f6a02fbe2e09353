#include "lab/bench/two_builds/build_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
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
constexpr std::uint32_t kAoSamples = 4;

/// A scene and what the rays of its works are made from.
struct OpenScene {
    explicit OpenScene(const std::string& spec)
        : name(spec),
          scene(open_bench_scene(spec, ViewKind::kFill, ViewSpec())),
          primary(make_primary_work(scene.params)),
          hits(arena.execute([&] { return reference_hits(scene.bvh, primary); })) {}

    TraceWork work(const std::string& work) const {
        const auto secondary = [&](WorkKind kind, std::uint32_t samples = 1) {
            return make_secondary_work(primary, hits, scene.mesh(), kind, samples,
                                       primary.rays.size());
        };
        if (work == "primary") return primary;
        if (work == "one-ray") return make_row_work(scene.params);
        if (work == "shadow") return secondary(WorkKind::kShadow);
        if (work == "diffuse") return secondary(WorkKind::kDiffuse);
        if (work == "ao") return secondary(WorkKind::kAo, kAoSamples);
        throw Error(ErrorKind::kBadArgument, fmt::format("{}: no such work", work));
    }

    std::string name;
    ThreadArena arena{1};
    BenchScene scene;
    TraceWork primary;
    AlignedVector<Hit> hits;
};

class OpenWork final : public BuiltWork {
public:
    OpenWork(std::shared_ptr<OpenScene> scene, TraceWork work, OurTracer tracer)
        : scene_(std::move(scene)),
          work_(std::move(work)),
          tracer_(std::move(tracer)),
          parts_(work_.parts(kParts)),
          answers_(work_) {}

    std::size_t rays() const override { return work_.active_count; }
    std::size_t parts() const override { return parts_.size(); }
    void trace_part(std::size_t part) override {
        scene_->arena.execute([&] { tracer_.trace_part(work_, parts_[part], answers_); });
    }
    std::size_t answer_size() const override { return work_.any_hit() ? 1 : sizeof(Hit); }
    std::vector<unsigned char> answers() const override {
        TraceAnswers ordered = answers_;
        if (tracer_.in_image_order && !work_.any_hit()) to_ray_order(work_, ordered.hits);
        const std::size_t size = answer_size();
        std::vector<unsigned char> bytes(size * work_.rays.size());
        for (std::size_t i = 0; i < work_.rays.size(); ++i) {
            if (work_.active[i] == 0) continue;
            const void* const answer =
                work_.any_hit() ? static_cast<const void*>(&ordered.occluded[i]) : &ordered.hits[i];
            std::memcpy(&bytes[i * size], answer, size);
        }
        return bytes;
    }

private:
    std::shared_ptr<OpenScene> scene_;
    TraceWork work_;
    OurTracer tracer_;
    std::vector<WorkPart> parts_;
    TraceAnswers answers_;
};

std::unique_ptr<BuiltWork> open(const std::string& spec, const std::string& work,
                                const std::string& tracer_name, const std::string& simd) {
    // The scene that was opened last, since works of one scene are opened one after the other.
    static std::shared_ptr<OpenScene> scene;
    if (scene == nullptr || scene->name != spec) scene = std::make_shared<OpenScene>(spec);
    TraceWork rays = scene->work(work);
    const SimdTarget targets[] = {find_simd_target(simd)};
    for (OurTracer& tracer : our_tracers(scene->scene.bvh, targets)) {
        if (tracer.name == tracer_name && std::ranges::count(tracer.works, rays.kind) > 0)
            return std::make_unique<OpenWork>(scene, std::move(rays), std::move(tracer));
    }
    return nullptr;
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
