#include "app/report/policy_plot.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/errors.h"
#include "tools/plot/gnuplot.h"
#include "tools/plot/policy_panels.h"

namespace mray::app {
namespace {

plot::Panel scaling_panel(const PolicyReport& report) {
    plot::Panel panel{.title = "refit with transfer",
                      .x = {.title = "triangles", .scale = plot::Scale::kLog10},
                      .y = {.title = "ns a triangle"},
                      .legend = plot::Legend::kAbove};
    for (std::size_t b = 0; b < report.backends.size(); ++b) {
        plot::Curve curve{report.backends[b].runs.front().backend, {}, plot::style_of(b)};
        for (const RefitScaling& point : report.scaling) {
            if (point.backend != curve.title) continue;
            const auto triangles = static_cast<double>(point.triangles);
            curve.points.push_back({triangles, 1e6 * point.ms / triangles});
        }
        panel.curves.push_back(std::move(curve));
    }
    return panel;
}

plot::Figure figure_of(const PolicyReport& report) {
    plot::Figure figure{
        .title = fmt::format("Update policies: {}, {} triangles", report.head.scene,
                             report.head.triangles),
        .footer = fmt::format(
            "{}x{} pixels, {} rays; {}", report.head.width, report.head.height, report.rays,
            report.repeat == 1 ? std::string("one round")
                               : fmt::format("medians of {} rounds, with bars from the least to "
                                             "the largest",
                                             report.repeat)),
        .columns = 2,
        .panel_width = 520,
        .panel_height = 280};
    for (const PolicyComparison& comparison : report.backends) {
        for (plot::Panel& panel : plot::policy_panels(comparison, "frame"))
            figure.panels.push_back(std::move(panel));
    }
    if (!report.scaling.empty()) figure.panels.push_back(scaling_panel(report));
    return figure;
}

}  // namespace

void require_plotter(const std::string& file) {
    if (!file.ends_with(".svg") && !file.ends_with(".png")) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("--plot: {} ends neither in .svg nor in .png", file));
    }
    if (plot::has_gnuplot()) return;
    throw Error(
        ErrorKind::kUnavailable,
        "--plot: gnuplot is not installed; install gnuplot-nox, or take the figures from --csv");
}

void plot_policies(const PolicyReport& report, const std::string& file) {
    require_plotter(file);
    plot::draw(figure_of(report), file);
}

}  // namespace mray::app
