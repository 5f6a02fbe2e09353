// Meshes that tests trace: ordinary ones and those on which tracers fail.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "common/interop/arithmetic.h"
#include "common/scene/mesh.h"
#include "common/scene/scene_space.h"

namespace mray::test {

/// The same sequence everywhere (SplitMix64; G. Steele, D. Lea, C. Flood. Fast splittable
/// pseudorandom number generators. 2014).
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}

    std::uint64_t bits() {
        std::uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
        return z ^ (z >> 31);
    }
    std::uint32_t below(std::uint32_t end) { return static_cast<std::uint32_t>(bits() % end); }
    /// In [lower, upper).
    double real(double lower, double upper) {
        return lower + (upper - lower) * static_cast<double>(bits() >> 11) * 0x1p-53;
    }
    vec3 point(double extent = 1) {
        const double x = real(-extent, extent);
        const double y = real(-extent, extent);
        const double z = real(-extent, extent);
        return vec3(x, y, z);
    }

private:
    std::uint64_t state_;
};

/// A mesh in world space and in scene space.
class TestScene {
public:
    TestScene(std::vector<vec3> positions, std::vector<uvec3> triangles);

    const Topology& topology() const { return topology_; }
    const SceneSpace& space() const { return space_; }
    const std::vector<vec3>& world_positions() const { return world_; }
    const std::vector<vec3>& positions() const { return scene_; }
    std::size_t triangle_count() const { return topology_.triangles.size(); }

private:
    Topology topology_;
    std::vector<vec3> world_;
    SceneSpace space_;
    std::vector<vec3> scene_;
};

// Closed meshes around the origin with shared vertices.
TestScene icosphere(int levels, double radius = 1, const vec3& centre = {0, 0, 0});
TestScene torus(std::uint32_t rings, std::uint32_t sides);
TestScene grid_box(std::uint32_t cells);
TestScene star(int levels, std::uint64_t seed);

TestScene random_soup(std::uint32_t triangles, double size, std::uint64_t seed);
/// Long thin triangles whose tips point at `eye`.
TestScene needles_towards(const vec3& eye, std::uint32_t triangles, std::uint64_t seed);

struct NamedScene {
    std::string name;
    TestScene scene;
};
/// Meshes on which tracers have failed: needles, slivers, duplicates, triangles that are repeated,
/// coplanar sheets, one point, degenerate and not finite triangles, 0 to 5 triangles, far offsets,
/// tiny and huge scales, both at once.
std::vector<NamedScene> adversarial_scenes();

/// A ray in scene space from floats in world space.
Ray scene_ray(const TestScene& scene, vec3 org, vec3 dir, double tnear = 0,
              double tfar = std::numeric_limits<double>::infinity());

/// Rays of all sorts through a scene: from around it, inside it, from vertices, along axes (with
/// -0), at vertices, edges and centroids, in the planes of triangles.
std::vector<Ray> mixed_rays(const TestScene& scene, std::size_t count, std::uint64_t seed);

}  // namespace mray::test
