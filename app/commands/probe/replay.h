// Bundles of a ray: what goes into one, and tracing it again.
#pragma once

#include <span>

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/commands/pixel_probe.h"
#include "app/files/ray_bundle.h"

namespace mray::app {

/// The probed pixel with the triangles that decide it: all of a small scene, otherwise those whose
/// own boxes the ray meets and those that were hit.
RayBundle make_bundle(const ProbeReport& report, const ImageParams& params,
                      const Topology& topology, std::span<const vec3> positions);

/// `morphray probe BUNDLE`: traces the ray with every backend, alone and in its image. Returns
/// kCheckFailed unless all answers are that of brute force in the bundle. Throws Error.
ExitCode run_replay(const Options& options, const Messages& messages);

}  // namespace mray::app
