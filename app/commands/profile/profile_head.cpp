#include "app/commands/profile/profile_head.h"

namespace mray::app {

ReportHead profile_head(const Options& options, const Clip& clip) {
    const Topology& topology = clip.topology();
    return {
        "profile",          clip.name(),        topology.triangles.size(), topology.vertex_count,
        options.view.width, options.view.height};
}

}  // namespace mray::app
