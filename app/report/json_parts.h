// Parts that several reports have as JSON. A report is one object that begins with "command" and
// the results, and ends with "schema", "version" and "built_with". Hashes are 16 hexadecimal
// digits, times are milliseconds, and no number is ever NaN or infinite (null instead).
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "common/frame_times.h"
#include "common/report/compare.h"
#include "morphray/device.hpp"

namespace mray::app {

/// An object keeps its members in the order in which they were added.
using Json = nlohmann::ordered_json;

/// Bytes that are not UTF-8 become U+FFFD, numbers that are not finite null; indent -1: one line.
std::string json_text(Json report, int indent = 2);

struct ReportHead {
    std::string command;
    std::string scene;
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};

/// The command, the scene, its size and, if there is one, the image's size.
Json head_of(const ReportHead& head);
/// Adds the scene, its size and, if there is one, the image's size.
void add_scene(Json& json, const ReportHead& head);

/// Adds a member for each stage of a frame.
void add_times(Json& json, const FrameTimes& times);

Json of(const FrameDifference& difference);
Json of(const morphray::VulkanDeviceInfo& device);

}  // namespace mray::app
