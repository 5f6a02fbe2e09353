#include "app/report/profile_report.h"

#include <fmt/format.h>

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
    json["samples_ms"] = row.samples;
    return json;
}

}  // namespace

Json json_of(const ProfileReport& report) {
    Json json = head_of(report.head);
    json["rays"] = report.rays;
    json["repeat"] = report.repeat;
    json["peak_memory_bytes"] = report.peak_memory_bytes;
    json["options"] = report.options;
    json["frames"] = Json::array();
    for (const ProfileRow& row : report.rows) json["frames"].push_back(of(row));
    return json;
}

Table profile_table(const ProfileReport& report) {
    Table table({"frame", "backend", "deform", "update", "rebuild", "trace", "new trace", "Mray/s",
                 "SAH ratio"});
    const auto ms = [](double value) { return fmt::format("{:.3f}", value); };
    for (const ProfileRow& row : report.rows) {
        const FrameTimes& t = row.times;
        table.add({fmt::format("{}", row.frame), row.backend, ms(t.deform_ms),
                   ms(t.update.upload_ms + t.update.refit_ms), ms(t.update.rebuild_ms),
                   ms(t.trace_ms), ms(row.trace_rebuilt_ms),
                   fmt::format("{:.1f}", static_cast<double>(t.rays) / (t.trace_ms * 1e3 + 1e-9)),
                   fmt::format("{:.3f}", row.sah_cost / row.rebuilt_sah_cost)});
    }
    return table;
}

}  // namespace mray::app
