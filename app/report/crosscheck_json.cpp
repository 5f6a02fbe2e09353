#include "app/report/report_json.h"

#include "app/report/json_parts.h"
#include "common/text/number_text.h"

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

}  // namespace

std::string to_json(const CheckReport& report) {
    Json json = head_of(report.head);
    json["device"] = report.device;
    json["complete"] = report.complete;
    json["equal"] = report.equal();
    json["rows"] = Json::array();
    for (const CheckRow& row : report.rows) json["rows"].push_back(of(row));
    json["trees"] = Json::array();
    for (const TreeRow& row : report.trees) {
        json["trees"].push_back({{"frame", row.frame},
                                 {"equal", row.equal()},
                                 {"cpu_bvh_hash", hash_text(row.cpu_hash)},
                                 {"vulkan_bvh_hash", hash_text(row.vulkan_hash)}});
    }
    return json_text(json);
}

}  // namespace mray::app
