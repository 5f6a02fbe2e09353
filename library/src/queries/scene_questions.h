// Questions in world space about all triangles of a scene.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/thread_arena.h"
#include "common/interop/closest_rule.h"
#include "library/src/queries/point_order.h"
#include "library/src/queries/queries.h"
#include "library/src/queries/ray_space.h"
#include "library/src/scene/mesh_list.h"
#include "library/src/scene/pose_reader.h"
#include "morphray/queries.hpp"

namespace morphray::detail {

/// Answers as the members of Scene of these names, at the current pose. All arguments of the
/// constructor must outlive it. Threads may call at the same time.
class SceneQuestions {
public:
    SceneQuestions(const Queries& queries, const RaySpace& rays, const PoseReader& pose,
                   const MeshList& meshes, mray::ThreadArena& arena)
        : queries_(queries), rays_(rays), pose_(pose), meshes_(meshes), arena_(arena) {}

    AllHits intersect_all(std::span<const Ray> rays, const AllHitsOptions& options) const;
    Hit intersect(const Ray& ray, const Hit& after, Crossing crossing) const;
    Hit intersect_visible(const Ray& ray, std::span<const std::uint8_t> is_visible) const;
    void count(std::span<const Ray> rays, std::span<std::uint64_t> counts, Crossing crossing,
               Coherence coherence, const std::atomic<bool>* cancel) const;
    void winding(std::span<const Vec3> points, std::span<std::int32_t> windings,
                 const std::atomic<bool>* cancel) const;
    void contains(std::span<const Vec3> points, std::span<std::uint8_t> inside, FillRule rule,
                  const std::atomic<bool>* cancel) const;
    void closest_points(std::span<const Vec3> points, std::span<ClosestPoint> closest,
                        float max_distance, const std::atomic<bool>* cancel) const;
    void signed_distance(std::span<const Vec3> points, std::span<float> distances, FillRule rule,
                         float max_distance, const std::atomic<bool>* cancel) const;

private:
    template <class Find>
    Hit ask_one(const Ray& ray, Find find) const;
    /// Points in scene space; those that are not finite or too far away have is_within 0 and some
    /// place.
    struct ScenePoints {
        std::vector<mray::vec3> points;
        std::vector<std::uint8_t> is_within;
        /// The order to ask in.
        std::vector<std::uint32_t> order;
    };
    ScenePoints to_scene(std::span<const Vec3> points, PointOrder order) const;
    template <class Answer, class Find, class Visit>
    void ask_points(const ScenePoints& points, const std::atomic<bool>* cancel, Find find,
                    Visit visit) const;
    template <class Visit>
    void wind(std::span<const Vec3> world, const ScenePoints& points,
              const std::atomic<bool>* cancel, Visit visit) const;
    ClosestPoint to_world(mray::vec3 point, std::uint32_t prim_id, const mray::NearPoint& near,
                          double scale) const;
    float most_d2(float max_distance) const;
    float scene_t(const mray::Ray& ray, int t_exponent, float world_t, std::uint32_t passed) const;

    const Queries& queries_;
    const RaySpace& rays_;
    const PoseReader& pose_;
    const MeshList& meshes_;
    mray::ThreadArena& arena_;
};

}  // namespace morphray::detail
