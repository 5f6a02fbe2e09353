#include "app/report/report_json.h"

#include <fmt/format.h>

#include "app/report/json_parts.h"
#include "common/text/number_text.h"

namespace mray::app {

std::string to_json(const SceneReport& report) {
    Json json = head_of(report.head);
    json["first_frame"] = report.first_frame;
    json["last_frame"] = report.last_frame;
    json["fps"] = nullptr;
    if (report.fps) json["fps"] = *report.fps;
    if (report.bounds.empty()) {
        json["bounds"] = nullptr;
    } else {
        json["bounds"] = {{"lower", report.bounds.lower}, {"upper", report.bounds.upper}};
    }
    json["scene_exponent"] = report.exponent;
    json["not_finite"] = report.degenerate.not_finite;
    json["zero_area"] = report.degenerate.zero_area;
    json["topology_hash"] = hash_text(report.topology_hash);
    json["index"] = {{"state", name_of(report.index.state)},
                     {"file", report.index.file},
                     {"reason", report.index.reason}};
    json["textures"] = report.textures;
    json["textured_triangles"] = report.textured_triangles;
    json["trees"] = Json::array();
    for (const SceneReport::Tree& tree : report.trees) {
        Json row = {{"build", tree.build},
                    {"build_ms", tree.build_ms},
                    {"bvh_hash", hash_text(tree.bvh_hash)}};
        row.update(of(tree.stats));
        json["trees"].push_back(row);
    }
    return json_text(json);
}

std::string to_json(const ProgramReport& report) {
    Json json = head_of("info");
    json["build"] = report.build;
    json["builtins"] = Json::array();
    for (const ProgramReport::Builtin& builtin : report.builtins) {
        json["builtins"].push_back({{"name", builtin.name},
                                    {"description", builtin.description},
                                    {"default_triangles", builtin.default_triangles}});
    }
    json["backends"] = report.backends;
    return json_text(json);
}

std::string to_json(const std::vector<gpu::DeviceInfo>& devices) {
    Json json = head_of("devices");
    json["devices"] = Json::array();
    for (const gpu::DeviceInfo& device : devices) {
        json["devices"].push_back(
            {{"index", device.index},
             {"name", device.name},
             {"type", device.type},
             {"driver", device.driver},
             {"uuid", device.uuid},
             {"api", fmt::format("{}.{}", device.api_major, device.api_minor)},
             {"memory_bytes", device.memory_bytes},
             {"subgroup_size", device.subgroup_size},
             {"usable", device.unusable.empty()},
             {"unusable", device.unusable}});
    }
    return json_text(json);
}

}  // namespace mray::app
