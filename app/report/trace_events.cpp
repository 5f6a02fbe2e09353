#include "app/report/trace_events.h"

#include <cmath>
#include <utility>

#include "common/report/json_writer.h"

namespace mray::app {
namespace {

/// In microseconds, to a nanosecond.
double in_us(double ms) { return std::round(1e6 * ms) / 1e3; }

/// An event that names a process; with a "tid" added, a thread.
Json name_event(const char* kind, std::size_t pid, const std::string& name) {
    return {{"name", kind}, {"ph", "M"}, {"pid", pid}, {"args", {{"name", name}}}};
}

void add_stages(Json& events, std::size_t pid, std::size_t tid, const PolicyRun& run) {
    double at_ms = 0;
    for (const PolicyFrame& f : run.frames) {
        const FrameTimes& t = f.times;
        for (const auto& [stage, stage_ms] :
             {std::pair("deform", t.deform_ms), std::pair("upload", t.update.upload_ms),
              std::pair("refit", t.update.refit_ms), std::pair("decide", t.update.decide_ms),
              std::pair("restructure", t.update.restructure_ms),
              std::pair("rebuild", t.update.rebuild_ms), std::pair("trace", t.trace_ms)}) {
            if (stage_ms <= 0) continue;
            events.push_back(
                {{"name", stage},
                 {"ph", "X"},
                 {"pid", pid},
                 {"tid", tid},
                 {"ts", in_us(at_ms)},
                 {"dur", in_us(stage_ms)},
                 {"args", {{"frame", f.frame}, {"update", f.update}, {"reason", f.reason}}}});
            at_ms += stage_ms;
        }
    }
}

}  // namespace

std::string trace_events(const PolicyReport& report) {
    Json json = {{"displayTimeUnit", "ms"}, {"traceEvents", Json::array()}};
    Json& events = json["traceEvents"];
    for (std::size_t pid = 0; pid < report.backends.size(); ++pid) {
        const std::vector<PolicyRun>& runs = report.backends[pid].runs;
        events.push_back(name_event("process_name", pid, runs.front().backend));
        for (std::size_t tid = 0; tid < runs.size(); ++tid) {
            events.push_back(name_event("thread_name", pid, runs[tid].policy));
            events.back()["tid"] = tid;
            add_stages(events, pid, tid, runs[tid]);
        }
    }
    return json_text(json, -1);
}

}  // namespace mray::app
