#include "app/report/policy_report.h"
#include "app/report/profile_report.h"

#include "app/report/json_parts.h"
#include "common/report/spread.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

Json of(const ProfileRow& row) {
    Json json = {{"frame", row.frame}, {"backend", row.backend}};
    add_times(json, row.times);
    json["total_ms"] = row.times.total_ms();
    json["trace_rebuilt_ms"] = row.trace_rebuilt_ms;
    json["rays"] = row.times.rays;
    json["sah_cost"] = row.sah_cost;
    json["rebuilt_sah_cost"] = row.rebuilt_sah_cost;
    for (const SampleKind& kind : kSampleKinds) {
        const std::vector<double>& samples = row.samples.*kind.samples;
        const Spread spread = spread_of(samples);
        json["samples_ms"][kind.name] = samples;
        json["least_ms"][kind.name] = spread.least;
        json["spread_percent"][kind.name] = spread.percent;
    }
    return json;
}

/// Least, median and spread of the rounds.
Json of(const Spread& spread) {
    return {{"least_ms", spread.least},
            {"median_ms", spread.median},
            {"spread_percent", spread.percent}};
}

Json of(const PolicyRun& run) {
    Json hashes = Json::array();
    for (const PolicyFrame& frame : run.frames) hashes.push_back(hash_text(frame.hits_hash));
    return {{"policy", run.policy},
            {"backend", run.backend},
            {"total_ms", run.total_ms()},
            {"median_frame_ms", run.median_frame_ms()},
            {"worst_frame_ms", run.worst_frame_ms()},
            {"worst_trace_vs_rebuilt", run.worst_trace_vs_rebuilt()},
            {"regret", run.regret()},
            {"rebuilds", run.rebuilds()},
            {"total", of(spread_of(run.totals_ms))},
            {"hits_hashes", hashes}};
}

Json of(const PolicyRun& run, const PolicyFrame& frame) {
    Json json = {{"policy", run.policy},
                 {"backend", run.backend},
                 {"frame", frame.frame},
                 {"update", frame.update},
                 {"reason", frame.reason}};
    add_times(json, frame.times);
    json["trace"] = of(spread_of(frame.traces_ms));
    json["cost"] = of(spread_of(frame.costs_ms));
    json["trace_rebuilt_ms"] = frame.trace_rebuilt_ms;
    json["cost_ratio"] = frame.cost_ratio;
    json["build_pending"] = frame.build_pending;
    json["rays"] = frame.times.rays;
    json["hits_hash"] = hash_text(frame.hits_hash);
    return json;
}

}  // namespace

std::string to_json(const ProfileReport& report) {
    Json json = head_of(report.head);
    json["rays"] = report.rays;
    json["repeat"] = report.repeat;
    json["complete"] = report.complete;
    json["peak_memory_bytes"] = report.peak_memory_bytes;
    json["options"] = report.options;
    json["frames"] = Json::array();
    for (const ProfileRow& row : report.rows) json["frames"].push_back(of(row));
    return json_text(json);
}

std::string to_json(const PolicyReport& report) {
    Json json = head_of(report.head);
    json["rays"] = report.rays;
    json["repeat"] = report.repeat;
    json["policies"] = Json::array();
    json["frames"] = Json::array();
    json["best_schedules"] = Json::array();
    for (const PolicyComparison& comparison : report.backends) {
        for (const PolicyRun& run : comparison.runs) {
            json["policies"].push_back(of(run));
            for (const PolicyFrame& frame : run.frames) json["frames"].push_back(of(run, frame));
        }
        Json rebuilt = Json::array();
        for (const std::size_t index : comparison.best.rebuilds)
            rebuilt.push_back(comparison.runs.front().frames[index].frame);
        const std::string best = comparison.best_policy();
        json["best_schedules"].push_back({{"backend", comparison.runs.front().backend},
                                          {"total_ms", comparison.best.total},
                                          {"rebuilt_at", rebuilt},
                                          {"regret_against", best.empty() ? "best schedule" : best},
                                          {"regret_against_ms", comparison.runs.front().best_ms}});
    }
    return json_text(json);
}

}  // namespace mray::app
