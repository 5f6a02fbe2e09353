// Parts that several reports have as JSON.
//
// Every report is one object with "schema": "morphray/1", "command" and "version". Hashes are 16
// hexadecimal digits, times are milliseconds, and no number is ever NaN or infinite (null instead).
#pragma once

#include <string>

#include "app/report/report_head.h"
#include "common/bvh/bvh_stats.h"
#include "common/frame_times.h"
#include "tools/image/compare.h"
#include "tools/text/json_writer.h"

namespace mray::app {

/// The members that every report begins with: "schema", "command" and "version".
Json head_of(const std::string& command);
/// As above, then the scene, its size and, if there is one, the image's size.
Json head_of(const ReportHead& head);

/// Adds a member for each stage of a frame.
void add_times(Json& json, const FrameTimes& times);

Json of(const BvhStats& stats);
Json of(const FrameDifference& difference);

}  // namespace mray::app
