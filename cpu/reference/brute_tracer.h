// Every ray against every triangle.
#pragma once

#include <span>

#include "common/interop/ray.h"
#include "common/scene/mesh.h"
#include "common/scene_queries.h"

namespace mray::cpu {

/// Finds closest and any hits over a mesh (positions in scene space) that outlives it. Threads may
/// share one.
class BruteTracer {
public:
    BruteTracer(const Topology& topology, std::span<const vec3> positions)
        : topology_(&topology), positions_(positions) {}

    Hit intersect(const Ray& ray) const;
    bool occluded(const Ray& ray) const;

private:
    const Topology* topology_;
    std::span<const vec3> positions_;
};

/// Answers over a mesh (positions in scene space) that outlives it. Threads may share one.
class BruteQueries final : public SceneQueries {
public:
    BruteQueries(const Topology& topology, std::span<const vec3> positions)
        : topology_(&topology), positions_(positions) {}

    void count(std::span<const Ray> rays, Crossing crossing,
               std::span<std::uint64_t> counts) const override;
    void list(std::span<const Ray> rays, Crossing crossing, std::uint32_t most,
              HitLists& lists) const override;
    void intersect_after(std::span<const Ray> rays, std::span<const HitCursor> after,
                         Crossing crossing, std::span<Hit> hits) const override;
    void wind(std::span<const vec3> points, std::span<FloatWinding> windings,
              std::vector<UncertainCrossing>& uncertain) const override;
    void closest(std::span<const vec3> points, float most_d2,
                 std::span<ClosestTriangle> closest) const override;

private:
    const Topology* topology_;
    std::span<const vec3> positions_;
};

}  // namespace mray::cpu
