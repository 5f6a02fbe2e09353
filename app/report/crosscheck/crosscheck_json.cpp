#include <fmt/format.h>

#include <string_view>

#include "app/report/crosscheck/check_report.h"
#include "app/report/crosscheck/page.h"
#include "app/report/json_parts.h"
#include "common/text/number_text.h"
#include "common/version.h"

namespace mray::app {
namespace {

Json of(const CheckRow& row) {
    return {{"variant", row.variant()},
            {"backend", row.backend},
            {"simd", row.simd},
            {"update", row.update},
            {"refit_on", row.refit_on},
            {"frame", row.frame},
            {"rays", row.rays},
            {"reference", row.reference},
            {"equal", row.equal()},
            {"differences", app::of(row.difference)},
            {"expected_hits_hash", hash_text(row.expected_hits_hash)},
            {"hits_hash", hash_text(row.hits_hash)},
            {"expected_image_hash", hash_text(row.expected_image_hash)},
            {"image_hash", hash_text(row.image_hash)},
            {"trace_ms", row.trace_ms}};
}

Json of(const TreeRow& row) {
    return {{"frame", row.frame},
            {"equal", row.equal()},
            {"cpu_bvh_hash", hash_text(row.cpu_hash)},
            {"vulkan_bvh_hash", hash_text(row.vulkan_hash)}};
}

Json of(const QueryRow& row) {
    return {{"variant", row.variant},
            {"frame", row.frame},
            {"reference", row.reference},
            {"count", row.count},
            {"equal", row.equal()},
            {"differences", Json{{"all_hits", row.difference.all_hits},
                                 {"winding", row.difference.winding},
                                 {"closest", row.difference.closest}}}};
}

Json of(const CheckReport& report);

template <class Rows>
Json list_of(const Rows& rows) {
    Json json = Json::array();
    for (const auto& row : rows) json.push_back(of(row));
    return json;
}

Json of(const CheckReport& report) {
    Json json;
    add_scene(json, report.head);
    json["device"] = report.device;
    json["complete"] = report.complete;
    json["equal"] = report.equal();
    json["error"] = report.error;
    json["warnings"] = report.warnings;
    json["frames"] = report.frames;
    json["rows"] = list_of(report.rows);
    json["trees"] = list_of(report.trees);
    json["queries"] = list_of(report.queries);
    return json;
}

Json environment_json(const CheckEnvironment& environment) {
    Json json = {{"version", kVersionDetail},
                 {"command", environment.command},
                 {"simd", environment.simd},
                 {"devices", Json::array()}};
    for (const morphray::VulkanDeviceInfo& device : environment.devices)
        json["devices"].push_back(app::of(device));
    return json;
}

// A page describes at most so many rows.
constexpr std::size_t kDescribedRows = 100;

/// Describes the rows that differ.
Json details_of(const CrosscheckOptions& options, const CheckRun& run) {
    Json details = Json::array();
    CrosscheckOptions one = options;
    std::size_t described = 0;
    for (std::size_t scene = 0; scene < run.scenes.size(); ++scene) {
        const CheckReport& report = run.scenes[scene];
        one.source.scene = report.spec;
        for (std::size_t row = 0; row < report.rows.size(); ++row) {
            if (report.rows[row].equal() || ++described > kDescribedRows) continue;
            details.push_back(
                {{"scene", scene},
                 {"row", row},
                 {"text", describe_row(one, report.rows[row], report.frames.front())}});
        }
    }
    return details;
}

}  // namespace

Json crosscheck_json(const CheckRun& run) {
    Json json = head_of("crosscheck");
    json["error"] = run.error;
    json["scenes"] = list_of(run.scenes);
    json["complete"] = run.complete();
    json["equal"] = run.equal();
    json["environment"] = environment_json(run.environment);
    return json;
}

std::string to_json(const CheckRun& run) { return json_text(crosscheck_json(run)); }

std::string to_html(const CrosscheckOptions& options, const CheckRun& run) {
    Json report = crosscheck_json(run);
    report["details"] = details_of(options, run);
    std::string json = json_text(report, -1);
    // No "<" may end the element or begin a comment.
    for (std::size_t at = 0; (at = json.find('<', at)) != std::string::npos;)
        json.replace(at, 1, "\\u003c");
    constexpr std::string_view kPlace = "{{report}}";
    std::string page = kPage;
    return page.replace(page.find(kPlace), kPlace.size(), json);
}

}  // namespace mray::app
