#include "lab/accuracy/deformation.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <array>
#include <memory>
#include <optional>
#include <utility>

#include "common/update/tree_updater.h"
#include "cpu/cpu_backend.h"
#include "lab/methods/paper_2007.h"
#include "lab/methods/report.h"

namespace mray::lab {
namespace {

/// Restructures the refitted tree in every frame.
class RestructureAlways : public UpdatePolicy {
public:
    UpdateDecision plan() override { return {UpdateStep::kRefit, "first"}; }
    UpdateDecision review(const RefittedTree& tree) override {
        return {tree.restructured ? UpdateStep::kRefit : UpdateStep::kRestructure, "always"};
    }
    bool needs_tree_cost() const override { return true; }
};

/// A tree that follows the frames, and packets over it.
class Updated {
public:
    Updated(std::string name, std::string kind)
        : method(std::move(name)), family(std::move(kind)) {}
    virtual ~Updated() = default;
    /// Brings the tree to the frame. This is timed.
    virtual void update(const ChartScene& frame) = 0;
    virtual Tracer tracer(const ChartRays& rays) = 0;

    std::string method;
    std::string family;
};

class OursUpdated final : public Updated {
public:
    /// Without a policy it restructures in every frame. The topology outlives it.
    OursUpdated(std::string name, const Topology& topology, const ChartScene& first,
                std::optional<PolicyKind> kind)
        : Updated(std::move(name), "ours"), backend_(cpu::make_cpu_backend()) {
        auto policy = kind ? make_update_policy({.kind = *kind})
                           : std::unique_ptr<UpdatePolicy>(std::make_unique<RestructureAlways>());
        updater_.emplace(topology, first.scene_space.positions, *backend_, std::move(policy),
                         BuildConfig{}, UpdateConfig{}, &first.scene_space.bvh);
    }

    void update(const ChartScene& frame) override { updater_->update(frame.scene_space.positions); }
    Tracer tracer(const ChartRays& rays) override {
        return packet_tracer(backend_->host_tree(), best_simd_target(), rays.scene_space);
    }

private:
    std::unique_ptr<Backend> backend_;
    std::optional<TreeUpdater> updater_;
};

class PaperUpdated final : public Updated {
public:
    PaperUpdated(std::string name, const ChartScene& first, bool rebuilds)
        : Updated(std::move(name), "2007"), rebuilds_(rebuilds) {
        tree_ = build_paper_tree(first.topology, first.scene_space.positions);
    }

    void update(const ChartScene& frame) override {
        if (rebuilds_) tree_ = build_paper_tree(frame.topology, frame.scene_space.positions);
        refit(tree_, frame.topology, frame.world_space.positions);
    }
    Tracer tracer(const ChartRays& rays) override { return paper_tracer(tree_, rays.world_space); }

private:
    bool rebuilds_;
    PeerTree tree_;
};

/// How often a frame is traced, all methods in turn.
constexpr int kRounds = 5;
/// Rays whose speed counts, and rays that are hard to answer.
constexpr std::array kFrameKinds = {RayKind::kPrimary, RayKind::kAimed};

struct FrameScore {
    double update_ms = 0;
    /// By kind.
    std::array<Score, kFrameKinds.size()> scores;

    /// An update and a trace of camera rays.
    double ms() const { return update_ms + scores[0].ms; }
};

/// Traces rays of a kind by all methods, whose trees are at the frame.
void measure_rays(const ChartScene& scene, std::size_t kind, std::size_t count,
                  std::span<const std::unique_ptr<Updated>> methods, std::span<FrameScore> frame) {
    ChartRays rays{make_chart_rays(scene, kFrameKinds[kind], 0, count), {}};
    rays.world_space = to_world(rays.scene_space, scene.space);
    const ExactReferee our_referee(scene.topology, scene.scene_space.positions,
                                   scene.scene_space.bvh);
    const ExactReferee their_referee(scene.topology, scene.world_space.positions,
                                     scene.world_space.bvh);
    const Judge our_judge(our_referee, rays.scene_space);
    const Judge their_judge(their_referee, rays.world_space);
    const TileRange all = rays.scene_space.whole();
    std::vector<Tracer> tracers;
    for (std::size_t i = 0; i < methods.size(); ++i) {
        tracers.push_back(methods[i]->tracer(rays));
        tracers[i].trace(all);
        const Judge& judge = methods[i]->family == "ours" ? our_judge : their_judge;
        frame[i].scores[kind] = judge.score(tracers[i].answers(), all);
    }
    for (int round = 0; round < kRounds; ++round) {
        for (std::size_t i = 0; i < methods.size(); ++i) {
            Score& score = frame[i].scores[kind];
            const double ms = timed([&] { tracers[i].trace(all); });
            score.mrays.push_back(static_cast<double>(score.rays) / (1e3 * ms));
        }
    }
    for (FrameScore& one : frame) {
        Score& score = one.scores[kind];
        score.ms = static_cast<double>(score.rays) / (1e3 * spread_of(score.mrays).median);
    }
}

/// "in frame 12" or "in no frame": when the traces of the refitted tree have lost more time
/// than a build takes.
std::string rebuild_text(std::span<const double> frames,
                         std::span<const std::vector<FrameScore>> scores, std::size_t refitted,
                         std::size_t rebuilt) {
    double lost = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        lost += scores[i][refitted].scores[0].ms - scores[i][rebuilt].scores[0].ms;
        if (lost > scores[i][rebuilt].update_ms) return fmt::format("in frame {}", frames[i]);
    }
    return "in no frame";
}

}  // namespace

Chart deformation_chart(const ChartContext& context, const ChartInput& input,
                        const std::string& suffix) {
    std::vector<std::unique_ptr<Updated>> methods;
    std::vector<std::vector<FrameScore>> scores;
    WorldBounds bounds;
    for (const std::vector<vec3>& frame : input.frames)
        bounds.extend(chart_bounds(input.topology, frame));
    for (const std::vector<vec3>& frame : input.frames) {
        const ChartScene scene = make_chart_scene(input.topology, frame, bounds);
        if (methods.empty()) {
            methods.push_back(
                std::make_unique<OursUpdated>("refit", input.topology, scene, PolicyKind::kRefit));
            methods.push_back(
                std::make_unique<OursUpdated>("restructure", input.topology, scene, std::nullopt));
            methods.push_back(std::make_unique<OursUpdated>("rebuild", input.topology, scene,
                                                            PolicyKind::kRebuild));
            methods.push_back(std::make_unique<PaperUpdated>("2007 refit", scene, false));
            methods.push_back(std::make_unique<PaperUpdated>("2007 rebuild", scene, true));
        }
        std::vector<FrameScore>& one = scores.emplace_back(methods.size());
        for (std::size_t i = 0; i < methods.size(); ++i)
            one[i].update_ms = timed([&] { methods[i]->update(scene); });
        for (std::size_t kind = 0; kind < kFrameKinds.size(); ++kind)
            measure_rays(scene, kind, context.effort.chunk_rays, methods, one);
        context.done();
    }
    Table table = table_with(
        {"kind", "frame", "method", "family", "update [ms]", "frame [ms]", "shown [1/million]"});
    std::vector<std::uint64_t> wrong(methods.size());
    std::uint64_t rays = 0;
    for (std::size_t kind = 0; kind < kFrameKinds.size(); ++kind) {
        // Curves are made of rows that follow each other.
        for (std::size_t k = 0; k < methods.size(); ++k) {
            for (std::size_t i = 0; i < scores.size(); ++i) {
                const FrameScore& one = scores[i][k];
                const Score& score = one.scores[kind];
                wrong[k] += score.wrong();
                if (k == 0) rays += score.rays;
                add_row(table,
                        {name_of(kFrameKinds[kind]), number(input.frame_numbers[i]),
                         methods[k]->method, methods[k]->family, number(one.update_ms),
                         number(one.ms()), shown_rate(score)},
                        score);
            }
        }
    }
    const auto speed = [&](std::size_t frame, std::size_t method) {
        return number(scores[frame][method].scores[0].mrays_per_second());
    };
    const std::size_t last = scores.size() - 1;
    plot::Figure figure{
        .title = fmt::format(
            "Degrading trees on {} ({} triangles, {} camera rays a frame). Refitted since frame "
            "{}, "
            "our tree goes from {} to {} Mray/s, with {} wrong answers of {}; that of 2007 from {} "
            "to {}, with {}. Traces of the method of 2007 have lost more time than a build takes "
            "{}; "
            "ours {}",
            input.name, input.topology.triangles.size(), scores[0][0].scores[0].rays,
            number(input.frame_numbers[0]), speed(0, 0), speed(last, 0), wrong[0], count_text(rays),
            speed(0, 3), speed(last, 3), wrong[3], rebuild_text(input.frame_numbers, scores, 3, 4),
            rebuild_text(input.frame_numbers, scores, 0, 2)),
        .footer = context.footer,
        .panel_height = 300,
        .panels = {}};
    const auto panel = [&](const char* kind, RayKind rays_of, const char* title, const char* x,
                           const char* y, const std::string& xlabel, const std::string& ylabel) {
        figure.panels.push_back({{"kind", kind},
                                 {"title", title},
                                 {"where", "kind"},
                                 {"is", name_of(rays_of)},
                                 {"series", "method"},
                                 {"x", x},
                                 {"y", y},
                                 {"xlabel", xlabel},
                                 {"ylabel", ylabel}});
        return &figure.panels.back();
    };
    const std::string mrays =
        fmt::format("Mray/s on {} threads", tbb::this_task_arena::max_concurrency());
    plot::Panel* speeds =
        panel("lines", RayKind::kPrimary, "camera rays", "frame", "speed [Mray/s]", "frame", mrays);
    speeds->insert(
        {{"lower", "speed lower quartile [Mray/s]"}, {"upper", "speed upper quartile [Mray/s]"}});
    panel("lines", RayKind::kPrimary, "update and camera rays", "frame", "frame [ms]", "frame",
          "ms");
    plot::Panel* both =
        panel("points", RayKind::kAimed, "rays at vertices and edges, a point a frame",
              "shown [1/million]", "speed [Mray/s]", kWrongLabel, mrays);
    both->insert({{"xlower", "wrong lower 95 % [1/million]"},
                  {"xupper", "wrong upper 95 % [1/million]"},
                  {"lower", "speed lower quartile [Mray/s]"},
                  {"upper", "speed upper quartile [Mray/s]"},
                  {"hollow", "wrong"},
                  {"logx", "10"}});
    return {
        "deformation" + suffix, std::move(table), {{"deformation" + suffix, std::move(figure)}}};
}

}  // namespace mray::lab
