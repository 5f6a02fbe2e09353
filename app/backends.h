// Which backends there are. The only place that knows whether Vulkan was built in.
#pragma once

#include <memory>
#include <vector>

#include "app/cli/options.h"
#include "app/terminal/messages.h"
#include "common/backend.h"
#include "common/update/session.h"
#include "gpu/vulkan_backend.h"

namespace morphray::app {

bool vulkan_built_in();

/// gpu::list_devices(); throws Error(kUnavailable) without Vulkan.
std::vector<gpu::DeviceInfo> vulkan_devices();

/// kAuto is Vulkan where there is a GPU, otherwise the CPU, with one warning if Vulkan cannot be
/// had at all (not where its only devices run on the CPU themselves, several times as slowly);
/// naming a device or asking for validation rules the CPU out. Throws Error(kUnavailable).
std::unique_ptr<Backend> make_backend(const BackendOptions& options, const Messages& messages);

/// Likewise for a backend other than the one asked for.
std::unique_ptr<Backend> make_backend(BackendChoice choice, const BackendOptions& options,
                                      const Messages& messages);

/// How the options say that the tree is built and kept up to date.
SessionConfig session_config(const Options& options);

/// The session that the options ask for: makes the backends and builds at the first frame.
Session open_session(const Options& options, SceneFrames& frames, double first_frame,
                     const Messages& messages);

/// CPU and Vulkan unless one is asked for; without Vulkan the CPU alone is still worth a table.
std::vector<BackendChoice> profiled_backends(const Options& options, const Messages& messages);

}  // namespace morphray::app
