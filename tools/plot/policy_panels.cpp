#include "tools/plot/policy_panels.h"

#include <fmt/format.h>

#include <algorithm>

namespace mray::plot {
namespace {

/// A tree of no cost at first may have an infinite ratio.
constexpr double kLeastRatio = 1e-3;
constexpr double kMostRatio = 1e6;

template <class Value>
Panel by_frame(const PolicyComparison& comparison, const std::string& title,
               const std::string& frames, const char* y, Value value) {
    Panel panel{.title = title,
                .x = {.title = frames, .scale = Scale::kLinear, .tight = true},
                .y = {.title = y}};
    for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
        Curve& curve = panel.curves.emplace_back();
        curve.title = comparison.runs[i].policy;
        curve.style = style_of(i);
        curve.style.symbol_size = 0.6;
        for (const PolicyFrame& frame : comparison.runs[i].frames)
            curve.points.push_back({frame.frame, value(frame)});
    }
    return panel;
}

Panel totals(const PolicyComparison& comparison, const std::string& title) {
    Panel panel{.title = title, .x = {.title = "frames that a tree is used"}, .y = {.title = "ms"}};
    Curve& periods = panel.curves.emplace_back();
    periods.title = "every:K, added up";
    periods.style = {.colour = kGuideColour, .symbols = false};
    for (std::size_t k = 1; k <= comparison.costs.first.size(); ++k) {
        const double ms = periodic_total(comparison.costs, k);
        if (ms >= 0) periods.points.push_back({static_cast<double>(k), ms});
    }
    for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
        const PolicyRun& run = comparison.runs[i];
        Curve& curve = panel.curves.emplace_back();
        curve.title = run.policy;
        curve.style = style_of(i);
        curve.style.line = false;
        curve.style.symbol_size = 1.2;
        curve.points = {
            {static_cast<double>(run.frames.size()) / static_cast<double>(run.rebuilds() + 1),
             run.total_ms()}};
    }
    return panel;
}

}  // namespace

std::vector<Panel> policy_panels(const PolicyComparison& comparison, const std::string& frames) {
    const std::string backend = comparison.runs.front().backend;
    std::vector<Panel> panels{
        by_frame(comparison, "trace, " + backend, frames, "ms",
                 [](const PolicyFrame& frame) { return frame.times.trace_ms; }),
        by_frame(comparison, "quality of the tree, " + backend, frames,
                 "SAH cost / SAH cost at its build",
                 [](const PolicyFrame& frame) {
                     return std::clamp(frame.cost_ratio, kLeastRatio, kMostRatio);
                 }),
        by_frame(comparison, "update and trace, " + backend, frames, "ms",
                 [](const PolicyFrame& frame) { return frame.cost_ms(); }),
        totals(comparison, "total of the clip, " + backend)};
    // One legend beside each row.
    panels[0].legend = panels[2].legend = Legend::kNone;
    return panels;
}

}  // namespace mray::plot
