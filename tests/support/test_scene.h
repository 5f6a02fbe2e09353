// Meshes that tests trace and move, and rays and points for them.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "common/backend.h"
#include "common/scene/mesh.h"
#include "common/scene/pose.h"
#include "common/scene/scene_space.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace mray::test {

/// A mesh in world space and in scene space.
class TestScene {
public:
    TestScene(std::vector<vec3> positions, std::vector<uvec3> triangles);
    TestScene(const Shape& shape)
        : TestScene({shape.positions.begin(), shape.positions.end()}, shape.triangles) {}

    const Topology& topology() const { return topology_; }
    const SceneSpace& space() const { return space_; }
    const std::vector<vec3>& world_positions() const { return world_; }
    const std::vector<vec3>& positions() const { return scene_; }
    /// These positions, for backends.
    const Pose& pose() const { return pose_; }
    std::size_t triangle_count() const { return topology_.triangles.size(); }

private:
    Topology topology_;
    std::vector<vec3> world_;
    SceneSpace space_;
    std::vector<vec3> scene_;
    Pose pose_;
};

/// A backend's scene with a pose of its own. No call but the next set_scene() may follow its end.
class MovingScene {
public:
    MovingScene(Backend& backend, const TestScene& scene, const Bvh& bvh)
        : MovingScene(backend, scene.topology(), scene.pose(), bvh) {}
    MovingScene(Backend& backend, const Topology& topology, const Pose& pose, const Bvh& bvh)
        : backend_(backend), pose_(pose) {
        backend.set_scene(topology, pose_, bvh);
    }
    MovingScene(const MovingScene&) = delete;

    std::uint64_t refit(std::span<const vec3> positions, RefitExtent extent = RefitExtent::kMoved) {
        pose_.move_to(positions);
        return backend_.refit(extent);
    }
    void set_tree(std::span<const vec3> positions, const Bvh& bvh) {
        pose_.move_to(positions);
        backend_.set_tree(bvh);
    }

private:
    Backend& backend_;
    Pose pose_;
};

inline TestScene torus(std::uint32_t rings, std::uint32_t sides) {
    return shapes::torus(rings, sides);
}
inline TestScene grid_box(std::uint32_t cells) { return shapes::grid_box(cells); }
inline TestScene star(int levels, std::uint64_t seed) { return shapes::star(levels, seed); }
TestScene icosphere(int levels, double radius = 1, const dvec3& centre = {0, 0, 0});
TestScene random_soup(std::uint32_t triangles, double size, std::uint64_t seed);

struct NamedScene {
    std::string name;
    TestScene scene;
};
/// Shapes on which tracers have failed, with some hundred triangles each; 0 to 5 triangles;
/// vertices that are not finite, far offsets, tiny and huge scales, both at once.
std::vector<NamedScene> adversarial_scenes();

/// A ray in scene space from floats in world space.
Ray scene_ray(const TestScene& scene, vec3 org, vec3 dir, double tnear = 0,
              double tfar = std::numeric_limits<double>::infinity());

/// Rays from around a scene, from inside it and from its vertices, at vertices, edges and any
/// place, along axes.
std::vector<Ray> mixed_rays(const TestScene& scene, std::size_t count, std::uint64_t seed);
/// Special points (tests/support/places.h) in scene space, within its extent.
std::vector<vec3> mixed_points(const TestScene& scene, std::size_t count, std::uint64_t seed);

}  // namespace mray::test
