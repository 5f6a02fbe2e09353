// Parts that several reports have as JSON.
//
// Every report is one object with "schema": "morphray/1", "command", "version" and "built_with".
// Hashes are 16 hexadecimal digits, times are milliseconds, and no number is ever NaN or infinite
// (null instead).
#pragma once

#include <string>
#include <string_view>

#include "app/report/report_head.h"
#include "common/bvh/bvh_stats.h"
#include "common/frame_times.h"
#include "common/report/compare.h"
#include "common/report/json_writer.h"

namespace mray::app {

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
