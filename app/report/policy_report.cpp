#include "app/report/policy_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/report/spread.h"

namespace mray::app {
namespace {

/// At most 7 characters below a hundred thousand.
std::string ms(double value) { return fmt::format("{:.{}f}", value, value < 999.9995 ? 3 : 1); }

std::string per_cent(double part) { return fmt::format("{:.1f}", 100 * part); }

}  // namespace

RoundLines::RoundLines(std::span<const PolicySpec> policies, int repeat) {
    std::size_t policy_width = 0;
    for (const PolicySpec& policy : policies)
        policy_width = std::max(policy_width, text_of(policy).size());
    columns_ = {{"round", fmt::format("{}", repeat).size()},
                {"policy", policy_width, false},
                {"backend", 0, false},
                {"total", 7},
                {"median", 7},
                {"worst", 7},
                {"rebuilds"}};
}

std::string RoundLines::header() const {
    return "times in ms of one round each; total: of its frames; median, worst: of a frame\n" +
           header_text(columns_);
}

std::string RoundLines::row(int round, const PolicyRun& run) const {
    return row_text(columns_, std::vector<std::string>{
                                  fmt::format("{}", round), run.policy, run.backend,
                                  ms(run.total_ms()), ms(run.median_frame_ms()),
                                  ms(run.worst_frame_ms()), fmt::format("{}", run.rebuilds())});
}

std::string policy_text(const PolicyReport& report) {
    Table table({"policy", "backend", "total", "least", "spread", "median", "worst", "slower",
                 "regret", "rebuilds"});
    for (const PolicyComparison& comparison : report.backends) {
        for (const PolicyRun& run : comparison.runs) {
            const Spread total = spread_of(run.totals_ms);
            table.add({run.policy, run.backend, ms(run.total_ms()), ms(total.least),
                       fmt::format("{:.1f}", total.percent), ms(run.median_frame_ms()),
                       ms(run.worst_frame_ms()),
                       fmt::format("{:.2f}", run.worst_trace_vs_rebuilt()), per_cent(run.regret()),
                       fmt::format("{}", run.rebuilds())});
        }
        const PolicyRun& first = comparison.runs.front();
        table.add({"(best schedule)", first.backend, ms(comparison.best.total), "", "", "", "", "",
                   per_cent(comparison.best.total / first.best_ms - 1),
                   fmt::format("{}", comparison.best.rebuilds.size())});
    }
    std::string text = fmt::format(
        "times in ms of {}; total: the medians of its frames; median, worst: of a frame\n"
        "least, spread: totals of the rounds, their middle half in %; regret in %\n"
        "slower: how many times as long the worst trace takes as over a new tree\n{}",
        report.repeat == 1 ? std::string("one round") : fmt::format("{} rounds", report.repeat),
        table.text());
    for (const PolicyComparison& comparison : report.backends) {
        const PolicyRun& first = comparison.runs.front();
        const std::string best = comparison.best_policy();
        text += fmt::format("regret on {}: beyond {} ms, {}\n", first.backend, ms(first.best_ms),
                            best.empty() ? "the best schedule of refits and rebuilds in hindsight"
                                         : "the total of " + best);
    }
    return text;
}

}  // namespace mray::app
