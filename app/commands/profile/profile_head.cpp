#include "app/commands/profile/profile_head.h"

#include "app/backends/backends.h"
#include "app/base/memory_budget.h"

namespace mray::app {
namespace {

constexpr std::uint64_t kYardstickBytes = std::uint64_t{16} << 20;

}  // namespace

ReportHead profile_head(const Options& options, const Clip& clip) {
    const Topology& topology = clip.topology();
    require_memory({.triangles = topology.triangles.size(),
                    .vertices = topology.vertex_count,
                    .copies = options.policies.empty() && !options.tree.update ? 3u : 1u,
                    .pixels = std::uint64_t{options.view.width} * options.view.height,
                    .devices = named_devices(options),
                    .kept_bytes = kYardstickBytes},
                   options.scene);
    return {
        "profile",          clip.name(),        topology.triangles.size(), topology.vertex_count,
        options.view.width, options.view.height};
}

}  // namespace mray::app
