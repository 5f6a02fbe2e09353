#include "app/report/policy_report.h"

#include <fmt/format.h>

#include "tools/text/table.h"

namespace mray::app {
namespace {

std::string ms(double value) { return fmt::format("{:.3f}", value); }

std::string per_cent(double part) { return fmt::format("{:.1f}", 100 * part); }

}  // namespace

std::string policy_text(const PolicyReport& report) {
    Table table({"policy", "backend", "total ms", "median ms", "worst ms", "worst trace/rebuilt",
                 "regret %", "rebuilds"});
    for (const PolicyComparison& comparison : report.backends) {
        for (const PolicyRun& run : comparison.runs) {
            table.add({run.policy, run.backend, ms(run.total_ms()), ms(run.median_frame_ms()),
                       ms(run.worst_frame_ms()),
                       fmt::format("{:.2f}", run.worst_trace_vs_rebuilt()), per_cent(run.regret()),
                       fmt::format("{}", run.rebuilds())});
        }
        const PolicyRun& first = comparison.runs.front();
        table.add({"(best schedule)", first.backend, ms(comparison.best.total), "", "", "",
                   per_cent(comparison.best.total / first.best_ms - 1),
                   fmt::format("{}", comparison.best.rebuilds.size())});
    }
    std::string text = table.text();
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
