// Parts of the JSON of a cross-check that other files have, too.
#pragma once

#include "app/report/crosscheck/check_report.h"
#include "common/report/json_writer.h"

namespace mray::app {

/// The object that --json writes.
Json crosscheck_json(const CheckRun& run);

/// Version, command, instruction sets and devices.
Json environment_json(const CheckEnvironment& environment);

}  // namespace mray::app
