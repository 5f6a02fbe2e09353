#include "app/report/json_parts.h"

#include <fmt/format.h>

#include "common/version.h"

namespace mray::app {

std::string json_text(Json report, int indent) {
    report.update({{"schema", "morphray/1"},
                   {"version", kVersion},
                   {"built_with", {{"compiler", kCompiler}}}});
    return report.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json head_of(const char* command, const Animation& animation) {
    return {{"command", command},
            {"scene", animation.name()},
            {"triangles", animation.topology().triangles.size()},
            {"vertices", animation.topology().vertex_count}};
}

void add_times(Json& json, const FrameTimes& times) {
    json["deform_ms"] = times.deform_ms;
    json["upload_ms"] = times.update.upload_ms;
    json["refit_ms"] = times.update.refit_ms;
    json["decide_ms"] = times.update.decide_ms;
    json["restructure_ms"] = times.update.restructure_ms;
    json["rebuild_ms"] = times.update.rebuild_ms;
    json["trace_ms"] = times.trace_ms;
}

Json of(const FrameDifference& difference) {
    return {{"total", difference.total()},
            {"false_miss", difference.false_miss},
            {"false_hit", difference.false_hit},
            {"prim_id", difference.prim_id},
            {"t", difference.t},
            {"uv", difference.uv},
            {"occlusion", difference.occlusion},
            {"colour", difference.colour}};
}

Json of(const morphray::VulkanDeviceInfo& device) {
    return {{"index", device.index},
            {"name", device.name},
            {"type", device.type},
            {"driver", device.driver},
            {"api", fmt::format("{}.{}", device.api_major, device.api_minor)},
            {"uuid", device.uuid}};
}

}  // namespace mray::app
