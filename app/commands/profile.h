// `morphray profile` measures the stages of a frame (profile.cpp) or update policies
// (profile_policies.cpp). Both use these parts of reports.
#pragma once

#include "app/commands/commands.h"
#include "app/report/json_parts.h"

namespace mray::app {

ExitCode profile_policies(const Options& options, const Messages& messages);

/// The scene, what is traced, and the environment.
Json profile_head(const Options& options, const Animation& animation,
                  const std::vector<morphray::Device>& devices);
/// "AMD EPYC, ...; cpu: avx2, 2 threads; morphray 0.2.0 (1a2b3c4d)".
std::string environment_text(const Json& report);

inline constexpr const char* kEnvironmentColumns[] = {"machine", "device", "version"};
/// Adds the cells of a CSV row that say where it was measured.
void add_environment(std::vector<std::string>& row, const Json& report, const std::string& backend);

inline std::string fixed_ms(double value) { return fmt::format("{:.3f}", value); }

}  // namespace mray::app
