#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "accuracy/charts/charts.h"
#include "common/update/policy_runs.h"

namespace mray::accuracy {
namespace {

const std::vector<std::string> kPolicies{"refit", "rebuild", "every:4", "auto"};
constexpr std::uint32_t kMostSide = 512;

/// At most so many frames of the clip, the first and the last among them, with equal steps but for
/// rounding to whole frames.
std::vector<double> spread_frames(const Clip& clip, std::size_t most) {
    const double first = clip.first_frame();
    const double last = clip.last_frame();
    const auto whole = static_cast<std::size_t>(last - first) + 1;
    const std::size_t count = std::min(whole, most);
    std::vector<double> frames;
    for (std::size_t i = 0; i < count; ++i) {
        frames.push_back(first +
                         std::round((last - first) * static_cast<double>(i) /
                                    static_cast<double>(std::max<std::size_t>(1, count - 1))));
    }
    return frames;
}

std::string panel(const std::string& file, const char* title, const char* scale, const char* y,
                  const char* value) {
    std::string text =
        fmt::format("set title '{}' font ',12'\nset xlabel 'frame'\nset ylabel '{}'\n{}\nplot ",
                    title, y, scale);
    for (std::size_t i = 0; i < kPolicies.size(); ++i) {
        text += fmt::format(
            "{0}'{1}.csv' using (strcol('policy') eq '{2}' ? column('frame') : NaN):({3}) with "
            "linespoints pt {4} ps 0.7 lw 2 lc {4} title '{2}'",
            i == 0 ? "" : ", ", file, kPolicies[i], value, i + 1);
    }
    return text + "\n";
}

}  // namespace

std::size_t policy_steps() { return 1; }

Chart policy_chart(const ChartContext& context, SceneFrames& scene, const std::string& suffix) {
    const std::string name = "policies" + suffix;
    const Topology& topology = scene.clip().topology();
    PlotScript script;
    script.title = fmt::format("Update policies: {}, {} triangles", scene.clip().name(),
                               topology.triangles.size());
    std::vector<PolicyComparison> comparisons;
    if (scene.clip().first_frame() == scene.clip().last_frame()) {
        context.step();
        return {name, "It has one frame, so its tree is never updated.",
                policy_frames_table(comparisons), script};
    }
    const std::uint32_t side = std::min(context.effort.side, kMostSide);
    ViewSpec view;
    view.width = view.height = side;
    view.fov = kChartFov;
    const std::vector<double> frames = spread_frames(scene.clip(), context.effort.policy_frames);
    SessionConfig session;
    session.threads = context.threads;
    PolicyRunner runner(scene, frames,
                        make_image_params(view, scene.clip().bounds(), scene.space()), session,
                        context.effort.rounds, context.make_cpu_backend());
    comparisons.push_back(runner.compare(kPolicies, context.check));
    context.step();

    script.footer = context.footer;
    script.width = 1700;
    script.height = 650;
    script.layout = "1,3";
    script.body =
        "set datafile columnheaders\n"
        "set key at screen 0.98,0.97 right top horizontal maxrows 1 noenhanced\n" +
        panel(name, "trace", "set yrange [0:*]", "ms", "column('trace ms')") +
        "unset label 1\nunset key\n" +
        panel(name, "quality of the tree", "set logscale y\nset yrange [*:*]",
              "SAH cost / SAH cost at its build", "column('cost ratio')") +
        panel(name, "update and trace", "unset logscale y\nset yrange [0:*]", "ms",
              "column('upload ms') + column('refit ms') + column('decide ms') + "
              "column('restructure ms') + column('rebuild ms') + column('trace ms')");
    return {name,
            fmt::format("On the CPU, {}x{} camera rays, {} frames of the clip. What a policy saves "
                        "in updates, it may lose in tracing; their sum is on the right.",
                        side, side, frames.size()),
            policy_frames_table(comparisons), script};
}

}  // namespace mray::accuracy
