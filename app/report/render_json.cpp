#include "app/report/render_report.h"

#include "app/report/json_parts.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

Json frame_json(const FrameReport& frame) {
    Json json = {{"frame", frame.frame},
                 {"backend", frame.backend},
                 {"update", frame.update},
                 {"refit_on", frame.refit_on},
                 {"hits_hash", hash_text(frame.hits_hash)},
                 {"image_hash", hash_text(frame.image_hash)},
                 {"bvh_hash", hash_text(frame.bvh_hash)}};
    add_times(json, frame.times);
    json["total_ms"] = frame.times.total_ms();
    json["read_wait_ms"] = frame.read_wait_ms;
    json["write_ms"] = frame.write_ms;
    json["write_wait_ms"] = frame.write_wait_ms;
    json["rays"] = frame.times.rays;
    json["hits"] = frame.hits;
    json["misses"] = frame.misses;
    json["occluded"] = frame.occluded;
    json["sah_cost"] = frame.sah_cost;
    json["cost_ratio"] = frame.cost_ratio;
    json["reason"] = frame.reason;
    json["file"] = frame.file;
    return json;
}

}  // namespace

std::string to_json(const RenderReport& report) {
    Json json = head_of(report.head);
    json["backend"] = report.backend;
    json["device"] = report.device;
    json["rays"] = report.rays;
    json["shading"] = report.shading;
    json["samples"] = report.samples;
    json["complete"] = report.complete;
    json["frames"] = Json::array();
    for (const FrameReport& frame : report.frames) json["frames"].push_back(frame_json(frame));
    json["kept"] = report.kept;
    return json_text(json);
}

}  // namespace mray::app
