#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "lab/accuracy/charts/charts.h"
#include "scenes/policy_runs.h"

namespace mray::accuracy {
namespace {

constexpr std::array kPolicies = {PolicySpec{PolicyKind::kRefit}, PolicySpec{PolicyKind::kRebuild},
                                  PolicySpec{PolicyKind::kEvery, 4}, PolicySpec{PolicyKind::kAuto}};
constexpr std::uint32_t kMostSide = 512;

/// The frames of the clip from the first on, in whole steps so that no more than `most` are played.
struct PlayedFrames {
    std::vector<double> frames;
    int step = 1;
};

PlayedFrames played_frames(const Clip& clip, std::size_t most) {
    const double first = clip.first_frame();
    const double last = clip.last_frame();
    PlayedFrames played;
    played.step =
        std::max(1, static_cast<int>(std::ceil((last - first) / static_cast<double>(most - 1))));
    for (double frame = first; frame <= last; frame += played.step) played.frames.push_back(frame);
    return played;
}

}  // namespace

std::size_t policy_steps() { return 1; }

Chart policy_chart(const ChartContext& context, SceneFrames& scene, const std::string& suffix) {
    const std::string name = "policies" + suffix;
    const Topology& topology = scene.clip().topology();
    plot::Figure figure;
    figure.title = fmt::format("Update policies: {}, {} triangles", scene.clip().name(),
                               topology.triangles.size());
    figure.footer = context.footer;
    std::vector<PolicyComparison> comparisons;
    if (scene.clip().first_frame() == scene.clip().last_frame()) {
        context.step();
        return {name, "It has one frame, so its tree is never updated.",
                policy_frames_table(comparisons), figure};
    }
    const std::uint32_t side = std::min(context.effort.side, kMostSide);
    ViewSpec view;
    view.width = view.height = side;
    view.fov = kChartFov;
    const PlayedFrames played = played_frames(scene.clip(), context.effort.policy_frames);
    PolicyRunner runner(scene, played.frames, view,
                        {.update = {}, .build = {.threads = context.threads}, .build_at = {}},
                        context.effort.rounds, context.make_cpu_backend());
    comparisons.push_back(runner.compare(kPolicies, context.check));
    context.step();

    figure.columns = 3;
    figure.panel_height = 420;
    figure.panels = policy_panels(
        comparisons,
        played.step == 1 ? "frame" : fmt::format("frame; one in {} is played", played.step));
    return {name,
            fmt::format(
                "On the CPU, {}x{} camera rays, {} frames of the clip; medians of {} rounds, "
                "with bars from the least. What a policy saves in updates, it may lose in tracing; "
                "their sum is on the right. Policies that take the same steps have one curve.",
                side, side, played.frames.size(), context.effort.rounds),
            policy_frames_table(comparisons), figure};
}

}  // namespace mray::accuracy
