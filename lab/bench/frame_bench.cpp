#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/frame_times.h"
#include "common/simd/simd_target.h"
#include "common/update/tree_updater.h"
#include "cpu/cpu_backend.h"
#include "lab/bench/peer_tree.h"
#include "lab/bench/works.h"

namespace mray::bench {
namespace {

// Frames of an animation that are played: every second one, from the first one on.
constexpr std::size_t kMostFrames = 12;
constexpr double kFrameStep = 2;

struct Played {
    const BenchScene& scene;
    ImageParams params;
    std::vector<std::vector<vec3>> poses;

    const Topology& topology() const { return scene.topology(); }
    cpu::ShadedMesh mesh(std::size_t frame) const { return {&scene.topology(), poses[frame]}; }
};

Played play(const BenchScene& scene) {
    Played played{scene, scene.params, {}};
    played.params.rays = kRaysShadow;
    const Animation& animation = *scene.animation;
    for (double frame = animation.first_frame();
         frame <= animation.last_frame() && played.poses.size() < kMostFrames; frame += kFrameStep)
        played.poses.push_back(positions_at(scene, frame));
    return played;
}

/// A way to bring a tree to a frame and to trace its image.
class FrameMethod {
public:
    explicit FrameMethod(const Played& played) : played_(played) {}
    virtual ~FrameMethod() = default;

    /// Returns the milliseconds that it took.
    virtual double run(std::size_t frame) = 0;

    std::uint64_t count_mismatches(const FrameMethod& other) const {
        std::uint64_t count = 0;
        for (std::size_t i = 0; i < frame_.hits.size(); ++i)
            count += frame_.hits[i].prim_id != other.frame_.hits[i].prim_id;
        return count;
    }

protected:
    const Played& played_;
    Frame frame_;
};

class OurFrames final : public FrameMethod {
public:
    OurFrames(const Played& played, int threads)
        : FrameMethod(played),
          backend_(cpu::make_cpu_backend({.threads = threads})),
          updater_(played.topology(), played.poses.front(), *backend_,
                   PolicySpec{.kind = PolicyKind::kAuto}, BuildConfig{.threads = threads},
                   UpdateConfig{}) {}

    double run(std::size_t frame) override {
        const Stopwatch stopwatch;
        updater_.update(played_.poses[frame]);
        backend_->trace_image(played_.params, frame_);
        updater_.frame_done({.ms = backend_->finish().trace_ms, .rays = backend_->finish().rays});
        return stopwatch.ms();
    }

private:
    std::unique_ptr<Backend> backend_;
    TreeUpdater updater_;
};

Frame empty_frame(const ImageParams& params) {
    const std::size_t pixels = std::size_t{params.width} * params.height;
    Frame frame;
    frame.width = params.width;
    frame.height = params.height;
    frame.hits.resize(pixels);
    frame.occlusion.resize(pixels);
    frame.pixels.resize(pixels);
    return frame;
}

/// Its positions are written to the mesh before the time begins. Shades by our code.
class EmbreeFrames final : public FrameMethod {
public:
    EmbreeFrames(const Played& played, const EmbreeDevice& device, RTCBuildQuality quality,
                 const SimdTarget& target, ThreadArena& arena)
        : FrameMethod(played),
          arena_(arena),
          mesh_(played.topology(), played.poses.front()),
          scene_(device, mesh_, quality),
          shader_(target) {
        frame_ = empty_frame(played.params);
    }

    double run(std::size_t frame) override {
        mesh_.set_positions(played_.poses[frame]);
        const Stopwatch stopwatch;
        scene_.update();
        arena_.execute(
            [&] { trace_frame(scene_, played_.params, played_.mesh(frame), shader_, frame_); });
        return stopwatch.ms();
    }

private:
    ThreadArena& arena_;
    EmbreeMesh mesh_;
    EmbreeScene scene_;
    cpu::PixelShader shader_;
};

/// Its packets are made before the time begins. Our code makes shadow rays and shades.
class PaperFrames final : public FrameMethod {
public:
    PaperFrames(const Played& played, const TraceWork& primary, const SimdTarget& target,
                ThreadArena& arena)
        : FrameMethod(played),
          primary_(primary),
          arena_(arena),
          tree_(build_paper_tree(played.topology(), played.poses.front())),
          camera_(paper_tracer(tree_, primary)),
          shader_(target) {
        frame_ = empty_frame(played.params);
    }

    double run(std::size_t frame) override {
        const Stopwatch to_hits;
        arena_.execute([&] {
            refit(tree_, played_.topology(), played_.poses[frame]);
            camera_.trace(primary_.whole());
        });
        const double to_hits_ms = to_hits.ms();
        const AlignedVector<Hit> hits = camera_.answers().hits;
        for (const TileRays& tile : primary_.tiles) {
            std::size_t ray = tile.begin;
            for_each_pixel(tile.tile, [&](std::uint32_t x, std::uint32_t y) {
                frame_.hits[std::size_t{y} * frame_.width + x] = hits[ray++];
            });
        }
        const cpu::ShadedMesh mesh = played_.mesh(frame);
        const TraceWork shadow = make_secondary_work(primary_, hits, mesh, WorkKind::kShadow);
        const Tracer light = paper_tracer(tree_, shadow);
        const Stopwatch from_hits;
        arena_.execute([&] {
            light.trace(shadow.whole());
            shade(mesh);
        });
        return to_hits_ms + from_hits.ms();
    }

private:
    /// Does the work that others do between rays.
    void shade(const cpu::ShadedMesh& mesh) {
        const cpu::ImageTiles squares(frame_.width, frame_.height, cpu::kSquareSide);
        tbb::parallel_for(std::uint32_t{0}, squares.count(), [&](std::uint32_t i) {
            cpu::SharedOriginRays rays[cpu::kSquareBlocks];
            cpu::LitPixels lit[cpu::kSquareBlocks];
            const std::uint8_t occluded[cpu::kSquareRays] = {};
            const cpu::PixelPart part{played_.params, mesh, squares[i], frame_};
            shader_.make_shadow_rays(part, rays, lit);
            shader_.shade_shadows(part, occluded, lit);
        });
    }

    const TraceWork& primary_;
    ThreadArena& arena_;
    PeerTree tree_;
    Tracer camera_;
    cpu::PixelShader shader_;
};

}  // namespace

void bench_frame(const Rig& rig, const BenchScene& scene, const TraceWork& primary) {
    const Played played = play(scene);
    if (played.poses.size() < 2) return;
    ThreadArena arena(rig.threads);
    std::vector<std::unique_ptr<FrameMethod>> frames;
    std::vector<Method> methods;
    const auto add = [&](std::unique_ptr<FrameMethod> added, std::string name, std::string group) {
        FrameMethod* const method = added.get();
        frames.push_back(std::move(added));
        methods.push_back({std::move(name),
                           {},
                           [method](std::size_t frame) { return method->run(frame); },
                           std::move(group),
                           [method, &frames] { return method->count_mismatches(*frames[0]); }});
    };
    const SimdTarget best = best_simd_target();
    add(std::make_unique<OurFrames>(played, rig.threads), "auto", "");
    for (const auto& [quality, name] : {std::pair(RTC_BUILD_QUALITY_REFIT, "REFIT"),
                                        {RTC_BUILD_QUALITY_LOW, "LOW"},
                                        {RTC_BUILD_QUALITY_MEDIUM, "MEDIUM"}}) {
        for (const EmbreeDevice& device : rig.devices) {
            add(std::make_unique<EmbreeFrames>(played, device, quality, best, arena),
                fmt::format("{}, Intersect16, {}", name, device.isa()), name);
        }
    }
    add(std::make_unique<PaperFrames>(played, primary, best, arena), "paper-2007, refit",
        "paper-2007");
    rig.report.compare({"frame", Unit::kMs}, methods, played.poses.size(), rig.repeat);
}

}  // namespace mray::bench
