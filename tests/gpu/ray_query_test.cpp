// The driver's own rays: refused in one line where there are none, checked against simple scenes
// where there are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/errors.h"
#include "common/interop/constants.h"
#include "gpu/ray_query/ray_query.h"

namespace mray::test {
namespace {

constexpr float kUnit = 65536;

/// Null on a device without ray queries, after a check of the refusal.
std::unique_ptr<DriverRays> driver_rays() {
    try {
        return gpu::make_ray_query({.device = "", .validate = true});
    } catch (const Error& error) {
        const std::string text = error.what();
        EXPECT_EQ(error.kind(), ErrorKind::kUnavailable);
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        EXPECT_TRUE(text.starts_with("ray-query: device ")) << text;
        EXPECT_NE(text.find("cannot be used: its driver lacks VK_KHR_"), std::string::npos) << text;
        return nullptr;
    }
}

/// Walls of 2x2 units across z, at z = 0, 1, ...: two triangles each.
struct Walls {
    Topology topology;
    std::vector<vec3> positions;
};

Walls walls(std::uint32_t count) {
    Walls made;
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t first = 4 * i;
        const float z = kUnit * static_cast<float>(i);
        for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
            made.positions.emplace_back(kUnit * static_cast<float>(x),
                                        kUnit * static_cast<float>(y), z);
        }
        made.topology.triangles.push_back({first, first + 1, first + 2});
        made.topology.triangles.push_back({first, first + 2, first + 3});
    }
    made.topology.vertex_count = static_cast<std::uint32_t>(made.positions.size());
    made.topology.albedo.assign(made.topology.triangles.size(), kDefaultAlbedo);
    return made;
}

Ray along_z(float x, float y, float z) {
    return {{kUnit * x, kUnit * y, kUnit * z}, 0, {0, 0, 1}, kInfiniteT};
}

TEST(RayQuery, FindsTheClosestTriangleWithItsWeights) {
    const auto rays = driver_rays();
    if (!rays) return;
    const Walls scene = walls(3);
    rays->set_scene(scene.topology, scene.positions);
    const std::vector<Ray> asked = {along_z(0.5f, -0.5f, -1), along_z(-0.5f, 0.5f, -1),
                                    along_z(0.5f, -0.5f, 0.5f), along_z(3, 0, -1),
                                    along_z(0.5f, -0.5f, 2.5f)};
    std::vector<Hit> hits(asked.size());
    rays->intersect(asked, hits);
    EXPECT_EQ(hits[0].prim_id, 0u);
    EXPECT_EQ(hits[0].t, kUnit);
    EXPECT_EQ(hits[0].u, 0.5f);
    EXPECT_EQ(hits[0].v, 0.25f);
    EXPECT_EQ(hits[1].prim_id, 1u);
    EXPECT_EQ(hits[2].prim_id, 2u);
    EXPECT_EQ(hits[3].prim_id, kNoPrim);
    EXPECT_EQ(hits[4].prim_id, kNoPrim);

    std::vector<std::uint8_t> occluded(asked.size(), 7);
    rays->occluded(asked, occluded);
    EXPECT_EQ(occluded, (std::vector<std::uint8_t>{1, 1, 1, 0, 0}));
}

TEST(RayQuery, ListsAllHitsInOrderAndCountsThoseWithoutRoom) {
    const auto rays = driver_rays();
    if (!rays) return;
    const Walls scene = walls(5);
    rays->set_scene(scene.topology, scene.positions);
    const std::vector<Ray> asked = {along_z(0.5f, -0.5f, -1), along_z(3, 0, -1),
                                    along_z(-0.5f, 0.5f, 2.5f)};
    HitLists lists;
    rays->list(asked, 3, lists);
    EXPECT_EQ(lists.total, (std::vector<std::uint64_t>{5, 0, 2}));
    EXPECT_EQ(lists.listed, (std::vector<std::uint32_t>{3, 0, 2}));
    ASSERT_EQ(lists.hits.size(), 5u);
    EXPECT_TRUE(std::is_sorted(lists.hits.begin(), lists.hits.begin() + 3,
                               [](const Hit& a, const Hit& b) { return a.t < b.t; }));
    EXPECT_EQ(lists.hits[3].prim_id, 7u);
    EXPECT_EQ(lists.hits[4].prim_id, 9u);
}

TEST(RayQuery, FollowsUpdatesAndRebuilds) {
    const auto rays = driver_rays();
    if (!rays) return;
    Walls scene = walls(1);
    rays->set_scene(scene.topology, scene.positions);
    const std::vector<Ray> asked = {along_z(0.5f, -0.5f, -1)};
    std::vector<Hit> hits(1);
    for (vec3& p : scene.positions) p.z = kUnit;
    EXPECT_TRUE(rays->update(scene.positions));
    rays->intersect(asked, hits);
    EXPECT_EQ(hits[0].t, 2 * kUnit);
    for (vec3& p : scene.positions) p.z = 3 * kUnit;
    rays->rebuild(scene.positions);
    rays->intersect(asked, hits);
    EXPECT_EQ(hits[0].t, 4 * kUnit);
}

TEST(RayQuery, BuildsAgainWhereAVertexBecomesInvalid) {
    const auto rays = driver_rays();
    if (!rays) return;
    Walls scene = walls(2);
    rays->set_scene(scene.topology, scene.positions);
    const std::vector<Ray> asked = {along_z(0.5f, -0.5f, -1)};
    std::vector<Hit> hits(1);
    scene.positions[1] = vec3(kInvalidCoordinate);
    EXPECT_FALSE(rays->update(scene.positions));
    rays->intersect(asked, hits);
    EXPECT_EQ(hits[0].prim_id, 2u);
    EXPECT_TRUE(rays->update(scene.positions));
}

TEST(RayQuery, TakesASceneOfNothing) {
    const auto rays = driver_rays();
    if (!rays) return;
    rays->set_scene(Topology{}, {});
    const std::vector<Ray> asked = {along_z(0, 0, -1)};
    std::vector<Hit> hits(1, Hit{1, 1, 1, 1});
    rays->intersect(asked, hits);
    EXPECT_EQ(hits[0].prim_id, kNoPrim);
}

}  // namespace
}  // namespace mray::test
