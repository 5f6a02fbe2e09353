// Makes the backends that the options choose. The only place that knows whether Vulkan was built
// in.
#pragma once

#include <memory>
#include <vector>

#include "app/cli/options.h"
#include "app/terminal/messages.h"
#include "common/backend.h"
#include "common/update/session.h"
#include "gpu/vulkan_backend.h"

namespace mray::app {

/// gpu::list_devices(); throws Error(kUnavailable) without Vulkan.
std::vector<gpu::DeviceInfo> vulkan_devices();

/// kAuto is Vulkan if there is a GPU, otherwise the CPU: with a warning if Vulkan is unavailable,
/// with a note if its only devices run on the CPU, which is several times slower. Naming a device
/// or asking for validation requires Vulkan. Throws Error(kUnavailable).
std::unique_ptr<Backend> make_backend(const BackendOptions& options, const Messages& messages);

/// As above, with `choice` in place of options.choice.
std::unique_ptr<Backend> make_backend(BackendChoice choice, const BackendOptions& options,
                                      const Messages& messages);

/// How the tree is built and updated.
SessionConfig session_config(const Options& options);

/// The session that the options ask for: makes the backends and builds at the first frame.
Session open_session(const Options& options, SceneFrames& frames, double first_frame,
                     const Messages& messages);

/// The chosen backend; for kAuto the CPU and, if it is available, Vulkan.
std::vector<BackendChoice> profiled_backends(const Options& options, const Messages& messages);

}  // namespace mray::app
