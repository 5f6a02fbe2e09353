#include "tests/support/test_scene.h"

#include <cmath>
#include <utility>

#include "common/bvh/box.h"
#include "tests/support/places.h"

namespace mray::test {

TestScene::TestScene(std::vector<vec3> positions, std::vector<uvec3> triangles)
    : world_(std::move(positions)), space_(bounds_of(world_)), scene_(world_.size()) {
    topology_.triangles = std::move(triangles);
    topology_.albedo.assign(topology_.triangles.size(), kDefaultAlbedo);
    topology_.vertex_count = static_cast<std::uint32_t>(world_.size());
    space_.to_scene(world_, scene_);
    pose_ = Pose(scene_);
}

TestScene icosphere(int levels, double radius, const dvec3& centre) {
    Shape shape = shapes::icosphere(levels);
    for (dvec3& p : shape.positions) p = centre + p * radius;
    return shape;
}

TestScene random_soup(std::uint32_t triangles, double size, std::uint64_t seed) {
    Random random(seed);
    return shapes::soup(random, static_cast<int>(triangles), size);
}

std::vector<NamedScene> adversarial_scenes() {
    constexpr int kCount = 300;
    Random random(1);
    std::vector<NamedScene> scenes;
    scenes.push_back({"needles", shapes::needles(random, kCount)});
    scenes.push_back({"slivers", shapes::slivers(random, kCount)});
    scenes.push_back({"soup", random_soup(500, 0.2, 2)});
    scenes.push_back({"large soup", random_soup(200, 2, 3)});
    scenes.push_back({"duplicates", shapes::duplicates(random, kCount)});
    scenes.push_back({"repeated", shapes::repeated(random, kCount)});
    scenes.push_back({"coplanar", shapes::coplanar_stack(random, kCount)});
    scenes.push_back({"equal corners", shapes::equal_corners(random, kCount)});
    scenes.push_back({"mixed sizes", shapes::mixed_sizes(random, kCount)});
    scenes.push_back({"progression", shapes::progression(60)});
    Shape nested, point, line;
    for (int i = 0; i < kCount; ++i) {
        const double s = 1 + i;
        nested.add_triangle({-s, -s, 0}, {s, -s, 0}, {0, 2 * s, 0});
        point.add_triangle(dvec3(0.25), dvec3(0.25), dvec3(0.25));
        const dvec3 a = random.grid_point();
        line.add_triangle(a, a + dvec3(0.25, 0, 0), a + dvec3(0.5, 0, 0));
    }
    scenes.push_back({"nested", nested});
    scenes.push_back({"one point", point});
    scenes.push_back({"collinear", line});
    Shape few;
    for (int n = 0; n <= 5; ++n) {
        scenes.push_back({std::to_string(n) + " triangles", few});
        few.add_triangle({0, 0, n}, {1, 0, n}, {0, 1, n});
    }
    Shape broken = shapes::icosphere(2);
    broken.positions[3].x = NAN;
    broken.positions[20].y = INFINITY;
    broken.positions[40].z = -INFINITY;
    scenes.push_back({"not finite", broken});
    scenes.push_back({"offset 1e5", icosphere(2, 2, {148376, 1234, -223423})});
    scenes.push_back({"offset 1e7", icosphere(2, 100, {1e7, 1e7, 1e7})});
    scenes.push_back({"collapsed by offset", icosphere(2, 1, {1e7, 1e7, 1e7})});
    for (const double scale : {1e-39, 1e-30, 1e-12, 1e12, 1e30})
        scenes.push_back({"scale", icosphere(2, scale)});
    scenes.push_back({"star", star(3, 5)});
    scenes.push_back({"torus", torus(24, 12)});
    scenes.push_back({"grid box", grid_box(8)});
    return scenes;
}

Ray scene_ray(const TestScene& scene, vec3 org, vec3 dir, double tnear, double tfar) {
    return to_scene(scene.space(), {dvec3(org), dvec3(dir), tnear, tfar}).ray;
}

std::vector<Ray> mixed_rays(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    constexpr double e = kSceneExtent;
    const auto vertex = [&] {
        const vec3 p = scene.positions().empty() ? random.point(e) : random.pick(scene.positions());
        return is_finite_vertex(p) ? p : vec3(0);
    };
    std::vector<Ray> rays;
    while (rays.size() < count) {
        vec3 org = random.one_in(3) ? vertex() : random.point(random.one_in(2) ? e : 3 * e);
        vec3 target = random.point(e);
        if (random.one_in(3)) target = vertex();
        if (random.one_in(6)) target = (vertex() + vertex()) * 0.5f;
        if (random.one_in(6)) {
            target = vertex();
            org = target - vec3(random.axis() * (2 * e));
        }
        const vec3 dir = canonical_direction(snap_point(target) - snap_point(org));
        const float tfar =
            random.one_in(8) ? static_cast<float>(random.real(0.1, 3) * e) : kInfiniteT;
        rays.push_back({snap_point(org), 0, dir, tfar});
    }
    return rays;
}

std::vector<vec3> mixed_points(const TestScene& scene, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    const Surroundings around(scene.world_positions(), scene.topology().triangles);
    std::vector<vec3> points;
    while (points.size() < count) {
        const vec3 point = scene.space().to_scene(special_point(random, around));
        if (largest_component(point) <= kSceneExtent) points.push_back(point);
    }
    return points;
}

}  // namespace mray::test
