// Parts that several reports have as JSON.
#pragma once

#include <string>

#include "app/report/reports.h"
#include "common/text/json.h"

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
