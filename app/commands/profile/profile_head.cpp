#include "app/commands/profile/profile_head.h"

#include "app/memory_budget.h"

namespace mray::app {

ReportHead profile_head(const Options& options, const Clip& clip) {
    const Topology& topology = clip.topology();
    require_memory({.triangles = topology.triangles.size(),
                    .vertices = topology.vertex_count,
                    .pixels = std::uint64_t{options.view.width} * options.view.height,
                    .backends = 3});
    return {
        "profile",          clip.name(),        topology.triangles.size(), topology.vertex_count,
        options.view.width, options.view.height};
}

}  // namespace mray::app
