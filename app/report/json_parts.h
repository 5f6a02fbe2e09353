// Parts that several reports have as JSON. A report is one object that begins with "command" and
// the results, and ends with "schema", "version" and "built_with". Hashes are 16 hexadecimal
// digits, times are milliseconds, and no number is ever NaN or infinite (null instead).
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/frame_times.h"
#include "morphray/device.hpp"
#include "report/compare.h"
#include "scenes/animation.h"

namespace mray::app {

/// An object keeps its members in the order in which they were added.
using Json = nlohmann::ordered_json;

/// Bytes that are not UTF-8 become U+FFFD, numbers that are not finite null; indent -1: one line.
std::string json_text(Json report, int indent = 2);

/// Every report of one scene begins with it.
Json head_of(const char* command, const Animation& animation);

void add_times(Json& json, const FrameTimes& times);

Json of(const FrameDifference& difference);
Json of(const morphray::VulkanDeviceInfo& device);

}  // namespace mray::app
