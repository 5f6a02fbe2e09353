// The cross-check of one scene.
#pragma once

#include <optional>
#include <vector>

#include "app/base/options.h"
#include "app/commands/crosscheck/cross_checker.h"
#include "app/report/crosscheck/check_report.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"

namespace mray::app {

/// The objects that the scenes of a call share.
struct SceneCheckContext {
    const Messages& messages;
    /// None: only the CPU is compared.
    const std::vector<morphray::VulkanDeviceInfo>& devices;
    /// Made for the first scene.
    std::optional<CheckedBackends>& backends;
};

/// Checks all frames of options.source.scene. `report` has what was compared also if this throws.
/// Returns kPartial, after a message, if a frame after the first one cannot be read. Throws what
/// scene, builder and backends throw.
ExitCode check_scene(const CrosscheckOptions& options, const SceneCheckContext& context,
                     CheckReport& report);

}  // namespace mray::app
