// Parts that several reports have as JSON. A report is one object that begins with "command" and
// the results, and ends with "schema", "version" and "built_with". Hashes are 16 hexadecimal
// digits, times are milliseconds, and no number is ever NaN or infinite (null instead).
#pragma once

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/version.h"
#include "morphray/device.hpp"
#include "scenes/animation.h"

namespace mray::app {

/// An object keeps its members in the order in which they were added.
using Json = nlohmann::ordered_json;

/// Bytes that are not UTF-8 become U+FFFD, numbers that are not finite null; indent -1: one line.
inline std::string json_text(Json report, int indent = 2) {
    report.update({{"schema", "morphray/1"},
                   {"version", kVersion},
                   {"built_with", {{"compiler", kCompiler}}}});
    return report.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

/// Every report of one scene begins with it.
inline Json head_of(const char* command, const Animation& animation) {
    return {{"command", command},
            {"scene", animation.name()},
            {"triangles", animation.topology().triangles.size()},
            {"vertices", animation.topology().vertex_count}};
}

inline Json of(const morphray::VulkanDeviceInfo& device) {
    return {{"index", device.index},
            {"name", device.name},
            {"type", device.type},
            {"driver", device.driver},
            {"api", fmt::format("{}.{}", device.api_major, device.api_minor)},
            {"uuid", device.uuid},
            {"rounding", device.promises_rounding ? "promised" : "tested"}};
}

}  // namespace mray::app
