#include "tools/plot/policy_panels.h"

#include <fmt/format.h>

#include <algorithm>

namespace mray::plot {
namespace {

/// A tree of no cost at first may have an infinite ratio.
constexpr double kLeastRatio = 1e-3;
constexpr double kMostRatio = 1e6;
constexpr double kWidestLine = 10;
constexpr double kLargestSymbol = 1.5;

Range range_of(const std::vector<double>& rounds) {
    const auto [least, most] = std::ranges::minmax(rounds);
    return {least, most};
}

/// The style of a policy. Policies often take the same steps: their curves lie on one another, and
/// each is wider than the next one, which is drawn on top of it.
Style style_of_policy(std::size_t policy, std::size_t policies) {
    Style style = style_of(policy);
    const auto below = static_cast<double>(policies - 1 - policy);
    style.line_width = std::min(1.5 + 2.5 * below, kWidestLine);
    style.symbol_size = std::min(0.5 + 0.3 * below, kLargestSymbol);
    return style;
}

template <class Value>
Panel by_frame(const PolicyComparison& comparison, const std::string& title,
               const std::string& frames, const char* y, Value value,
               std::vector<double> PolicyFrame::*rounds = nullptr) {
    Panel panel{.title = title,
                .x = {.title = frames, .scale = Scale::kLinear, .tight = true},
                .y = {.title = y}};
    for (std::size_t i = 0; i < comparison.runs.size(); ++i) {
        Curve& curve = panel.curves.emplace_back();
        curve.title = comparison.runs[i].policy;
        curve.style = style_of_policy(i, comparison.runs.size());
        for (const PolicyFrame& frame : comparison.runs[i].frames) {
            curve.points.push_back({frame.frame, value(frame)});
            if (rounds != nullptr) curve.ranges.push_back(range_of(frame.*rounds));
        }
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
        curve.style = style_of_policy(i, comparison.runs.size());
        curve.style.line = false;
        curve.style.symbol_size *= 1.6;
        curve.points = {
            {static_cast<double>(run.frames.size()) / static_cast<double>(run.rebuilds() + 1),
             run.total_ms()}};
        curve.ranges = {range_of(run.totals_ms)};
    }
    return panel;
}

}  // namespace

std::vector<Panel> policy_panels(const PolicyComparison& comparison, const std::string& frames) {
    const std::string backend = comparison.runs.front().backend;
    std::vector<Panel> panels{
        by_frame(
            comparison, "trace, " + backend, frames, "ms",
            [](const PolicyFrame& frame) { return frame.times.trace_ms; }, &PolicyFrame::traces_ms),
        by_frame(comparison, "quality of the tree, " + backend, frames,
                 "SAH cost / SAH cost at its build",
                 [](const PolicyFrame& frame) {
                     return std::clamp(frame.cost_ratio, kLeastRatio, kMostRatio);
                 }),
        by_frame(
            comparison, "update and trace, " + backend, frames, "ms",
            [](const PolicyFrame& frame) { return frame.cost_ms(); }, &PolicyFrame::costs_ms),
        totals(comparison, "total of the clip, " + backend)};
    // One legend beside each row.
    panels[0].legend = panels[2].legend = Legend::kNone;
    return panels;
}

}  // namespace mray::plot
