// Questions about all triangles, by the shared layout.
#pragma once

#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/interop/closest_rule.h"
#include "common/scene_queries.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// Answers over a tree that outlives it, with the bits of BruteQueries. Threads may share one.
/// Neighbours among the points of a call help each other.
class TreeQueries final : public SceneQueries {
public:
    TreeQueries(const Bvh& bvh, SimdTarget target);

    void count(std::span<const Ray> rays, Crossing crossing,
               std::span<std::uint64_t> counts) const override;
    void list(std::span<const Ray> rays, Crossing crossing, std::uint32_t most,
              HitLists& lists) const override;
    void intersect_after(std::span<const Ray> rays, std::span<const HitCursor> after,
                         Crossing crossing, std::span<Hit> hits) const override;
    void intersect_visible(std::span<const Ray> rays, const VisibleMeshes& meshes,
                           std::span<Hit> hits) const override;
    void wind(std::span<const vec3> points, std::span<FloatWinding> windings,
              std::vector<UncertainCrossing>& uncertain) const override;
    void closest(std::span<const vec3> points, float most_d2,
                 std::span<ClosestTriangle> closest) const override;

private:
    using Count = void (*)(const Bvh&, std::span<const Ray>, Crossing, std::span<std::uint64_t>);
    using List = void (*)(const Bvh&, std::span<const Ray>, Crossing, std::uint32_t, HitLists&);
    using After = void (*)(const Bvh&, std::span<const Ray>, std::span<const HitCursor>, Crossing,
                           std::span<Hit>);
    using Visible = void (*)(const Bvh&, std::span<const Ray>, const VisibleMeshes&,
                             std::span<Hit>);
    using Wind = void (*)(const Bvh&, std::span<const vec3>, std::span<FloatWinding>,
                          std::vector<UncertainCrossing>&);
    using Closest = void (*)(const Bvh&, std::span<const vec3>, float, std::span<ClosestTriangle>);

    const Bvh* bvh_;
    Count count_;
    List list_;
    After after_;
    Visible visible_;
    Wind wind_;
    Closest closest_;
};

/// Sets places[i] to closest_on_triangle() of points[i] and the triangle closest[i], with its bits;
/// to any place if there is none. Scene space.
void find_places(SimdTarget target, std::span<const vec3> points,
                 std::span<const ClosestTriangle> closest, std::span<const uvec3> triangles,
                 std::span<const vec3> positions, std::span<NearPoint> places);

}  // namespace mray::cpu
