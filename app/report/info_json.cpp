#include "app/report/scene_report.h"

#include <fmt/format.h>

#include <array>

#include "app/report/json_parts.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

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
        json["bounds"] = {{"lower", std::to_array(report.bounds.lower)},
                          {"upper", std::to_array(report.bounds.upper)}};
    }
    json["scene_exponent"] = report.exponent;
    json["not_finite"] = report.degenerate.not_finite;
    json["zero_area"] = report.degenerate.zero_area;
    json["topology_hash"] = hash_text(report.topology_hash);
    json["textures"] = report.textures;
    json["textured_triangles"] = report.textured_triangles;
    json["animations"] = Json::array();
    for (std::size_t i = 0; i < report.animations.size(); ++i) {
        const ClipAnimation& animation = report.animations[i];
        json["animations"].push_back(
            {{"index", i}, {"name", animation.name}, {"shown", animation.is_shown}});
    }
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

std::string to_json(const std::vector<morphray::VulkanDeviceInfo>& devices,
                    const std::vector<std::optional<morphray::DeviceCheck>>& checks) {
    Json json = head_of("devices");
    json["devices"] = Json::array();
    for (std::size_t i = 0; i < devices.size(); ++i) {
        const morphray::VulkanDeviceInfo& device = devices[i];
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
        if (!checks[i]) continue;
        json["devices"].back()["check"] = {{"passed", checks[i]->passed},
                                           {"problem", checks[i]->problem}};
    }
    return json_text(json);
}

std::string to_json(const std::vector<FileFormat>& formats) {
    Json json = head_of("info");
    json["formats"] = Json::array();
    for (const FileFormat& format : formats) {
        Json extensions = Json::array();
        for (const std::string_view extension : split(format.extensions, ' '))
            if (!extension.empty()) extensions.push_back(std::string(extension));
        json["formats"].push_back({{"use", std::string(format.use)},
                                   {"name", std::string(format.name)},
                                   {"extensions", extensions},
                                   {"read", format.is_read},
                                   {"written", format.is_written},
                                   {"content", std::string(format.content)}});
    }
    return json_text(json);
}

}  // namespace mray::app
