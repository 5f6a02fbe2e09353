// Reports as JSON.
//
// Every report is one object with "schema": "morphray/1", "command" and "version". Hashes are 16
// hexadecimal digits, times are milliseconds, and no number is ever NaN or infinite (null instead).
#pragma once

#include <string>
#include <vector>

#include "app/commands/pixel_probe.h"
#include "app/report/crosscheck/check_report.h"
#include "app/report/reports.h"

namespace mray::app {

std::string to_json(const RenderReport& report);
/// One scene: an object with its rows. Several: an object with "scenes", one such object each.
std::string to_json(const CheckRun& run);
std::string to_json(const DiffReport& report);
std::string to_json(const ImageDiffReport& report);
std::string to_json(const ExrDiffReport& report);
std::string to_json(const ProfileReport& report);
std::string to_json(const PolicyReport& report);
std::string to_json(const ProbeReport& report);
std::string to_json(const ReplayReport& report);
std::string to_json(const SceneReport& report);
std::string to_json(const ProgramReport& report);
std::string to_json(const std::vector<gpu::DeviceInfo>& devices);

}  // namespace mray::app
