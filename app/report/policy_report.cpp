#include "app/report/policy_report.h"

#include <fmt/format.h>

#include "app/report/report_json.h"

namespace morphray::app {
namespace {

std::string ms(double value) { return fmt::format("{:.3f}", value); }

std::string per_cent(double part) { return fmt::format("{:.1f}", 100 * part); }

}  // namespace

Table policy_table(const PolicyReport& report) {
    Table table({"policy", "backend", "total ms", "median ms", "worst ms", "worst trace/rebuilt",
                 "regret %", "rebuilds"});
    for (const PolicyComparison& comparison : report.backends) {
        for (const PolicyRun& run : comparison.runs) {
            table.add({run.policy, run.backend, ms(run.total_ms()), ms(run.median_frame_ms()),
                       ms(run.worst_frame_ms()),
                       fmt::format("{:.2f}", run.worst_trace_vs_rebuilt()), per_cent(run.regret()),
                       fmt::format("{}", run.rebuilds())});
        }
        table.add({"(best schedule)", comparison.runs.front().backend, ms(comparison.best.total),
                   "", "", "", "0.0", fmt::format("{}", comparison.best.rebuilds.size())});
    }
    return table;
}

std::string trace_events(const PolicyReport& report) {
    std::string events;
    const auto add = [&events](const std::string& event) {
        events += (events.empty() ? "" : ",\n") + event;
    };
    for (std::size_t pid = 0; pid < report.backends.size(); ++pid) {
        const std::vector<PolicyRun>& runs = report.backends[pid].runs;
        add(fmt::format(R"({{"name":"process_name","ph":"M","pid":{},"args":{{"name":"{}"}}}})",
                        pid, runs.front().backend));
        for (std::size_t tid = 0; tid < runs.size(); ++tid) {
            add(fmt::format(
                R"({{"name":"thread_name","ph":"M","pid":{},"tid":{},"args":{{"name":"{}"}}}})",
                pid, tid, runs[tid].policy));
            double at_us = 0;
            for (const PolicyFrame& f : runs[tid].frames) {
                const FrameTimes& t = f.times;
                for (const auto& [stage, stage_ms] :
                     {std::pair("deform", t.deform_ms), std::pair("upload", t.update.upload_ms),
                      std::pair("refit", t.update.refit_ms),
                      std::pair("decide", t.update.decide_ms),
                      std::pair("restructure", t.update.restructure_ms),
                      std::pair("rebuild", t.update.rebuild_ms), std::pair("trace", t.trace_ms)}) {
                    if (stage_ms <= 0) continue;
                    add(fmt::format(
                        R"({{"name":"{}","ph":"X","pid":{},"tid":{},"ts":{:.3f},"dur":{:.3f},)"
                        R"("args":{{"frame":{},"update":"{}","reason":"{}"}}}})",
                        stage, pid, tid, at_us, 1e3 * stage_ms, f.frame, f.update, f.reason));
                    at_us += 1e3 * stage_ms;
                }
            }
        }
    }
    return "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n" + events + "\n]}\n";
}

}  // namespace morphray::app
