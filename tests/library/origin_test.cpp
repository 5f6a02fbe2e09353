// Doubles far from 0 give the answers of the same scene near 0.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;
using morphray::Scene;

TEST(SceneOrigin, KeepsTheDigitsOfDoublesFarFromZero) {
    const morphray::Box bounds{{-3, -3, -3}, {3, 3, 3}};
    const UserMesh mesh(torus(40, 20));
    std::vector<std::array<double, 3>> doubles;
    for (const morphray::Vec3& p : mesh.points)
        doubles.push_back({p.x / 3.0 + 528980.85, p.y / 3.0 + 183526.1, p.z / 3.0 + 10});
    const morphray::Positions positions = morphray::packed(doubles);
    const morphray::Point origin = morphray::find_origin(positions);
    EXPECT_GT(morphray::rounding_error(positions, {}), 1e-3);
    EXPECT_LT(morphray::rounding_error(positions, origin), 1e-6);
    EXPECT_EQ(morphray::find_origin(morphray::packed(mesh.points)), morphray::Point{});
    EXPECT_EQ(morphray::find_origin({}), morphray::Point{});
    UserMesh near = mesh;
    const auto copy_to_near = [&] {
        for (std::size_t i = 0; i < doubles.size(); ++i) {
            const auto& p = doubles[i];
            near.points[i] = {static_cast<float>(p[0] - origin[0]),
                              static_cast<float>(p[1] - origin[1]),
                              static_cast<float>(p[2] - origin[2])};
        }
    };
    copy_to_near();
    const auto moved = [&](const morphray::Point& p, double sign) {
        return morphray::Point{p[0] + sign * origin[0], p[1] + sign * origin[1],
                               p[2] + sign * origin[2]};
    };
    const morphray::SceneOptions near_options{.bounds = bounds};
    const morphray::SceneOptions options{
        .bounds = morphray::Box{moved(bounds.lower, 1), moved(bounds.upper, 1)}, .origin = origin};
    Scene scene = Scene::build({positions, mesh.triangles}, Device::cpu(), options);
    EXPECT_EQ(scene.origin(), origin);
    EXPECT_EQ(scene.on(Device::brute_force()).origin(), origin);
    for (auto& p : doubles) p[1] += 0.1;
    scene.update();
    copy_to_near();
    const Scene expected = Scene::build(near.view(), Device::brute_force(), near_options);
    const std::vector<morphray::Ray> rays = world_rays(near, 1000, 65);
    expect_same_hits(hits_of(scene, rays), hits_of(expected, rays));
    EXPECT_EQ(scene.bounds().lower, moved(expected.bounds().lower, 1));
    EXPECT_EQ(scene.tree_boxes(0)[0].upper, moved(expected.tree_boxes(0)[0].upper, 1));
    EXPECT_EQ(scene.plus_origin({1, 2, 3}), moved({1, 2, 3}, 1));
    EXPECT_EQ(scene.less_origin(moved({1, 2, 3}, 1)), (morphray::Vec3{1, 2, 3}));
    const morphray::Point eye = {3, 4, 5};
    const morphray::View view{.eye = moved(eye, 1), .target = origin, .width = 64, .height = 64};
    const morphray::View near_view{
        .eye = eye, .target = morphray::Point{}, .width = 64, .height = 64};
    EXPECT_EQ(scene.render(view).hits_hash, expected.render(near_view).hits_hash);
    // Floats are of the caller's coordinates, too.
    const std::vector<morphray::Vec3> floats(3, {528981, 183526, 10});
    const std::vector<std::uint32_t> triangle = {0, 1, 2};
    const Scene of_floats =
        Scene::build({morphray::packed(floats), triangle}, Device::cpu(), {.origin = origin});
    EXPECT_EQ(of_floats.bounds().lower, (morphray::Point{528981, 183526, 10}));
    EXPECT_EQ(error_of([&] {
                  Scene::build(mesh.view(), Device::cpu(), {.origin = {0, std::nan(""), 0}});
              }),
              "bad_argument");
}

}  // namespace
}  // namespace mray::test
