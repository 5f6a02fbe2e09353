// Parts that several reports have as JSON.
//
// Every report is one object with "schema": "morphray/1", "command", "version" and "built_with".
// Hashes are 16 hexadecimal digits, times are milliseconds, and no number is ever NaN or infinite
// (null instead).
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "app/report/report_head.h"
#include "common/bvh/bvh_stats.h"
#include "common/frame_times.h"
#include "common/report/compare.h"

namespace mray::app {

/// An object keeps its members in the order in which they were added.
using Json = nlohmann::ordered_json;

/// The text with a final line end. Bytes that are not UTF-8 become U+FFFD, numbers that are not
/// finite become null. `indent` is per level; -1 gives a single line.
inline std::string json_text(const Json& json, int indent = 2) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

/// The members that every report begins with: "schema", "command", "version" and "built_with".
Json head_of(const std::string& command);
/// As above, then the scene, its size and, if there is one, the image's size.
Json head_of(const ReportHead& head);
/// As above without "built_with", for an object within a report that has it.
Json head_of_part(const ReportHead& head);

/// The text of an object with a last member `name`, an array of many values whose texts are given,
/// each on a line of its own with a comma before all but the first.
std::string json_with_rows(const Json& object, std::string_view name, std::string_view rows);

/// Adds a member for each stage of a frame.
void add_times(Json& json, const FrameTimes& times);

Json of(const BvhStats& stats);
Json of(const FrameDifference& difference);

}  // namespace mray::app
