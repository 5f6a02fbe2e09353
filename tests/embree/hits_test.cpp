// Hits of triangles and quads, intervals of rays, and rays that hit nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "morphray/device.hpp"
#include "tests/embree/door.h"

namespace mray {
namespace {

using namespace door_test;

TEST(DoorHits, HaveTheNormalAndWeightsOfEmbree) {
    const Door door;
    RTCScene scene = door.committed({door.triangle()});
    const RTCRayHit hit = trace(scene, down(0.25f, 0.5f, 2));
    EXPECT_EQ(hit.ray.tfar, 2);
    EXPECT_EQ(hit.hit.u, 0.25f);
    EXPECT_EQ(hit.hit.v, 0.5f);
    EXPECT_EQ(hit.hit.Ng_z, 1);
    EXPECT_EQ(hit.hit.geomID, 0u);
    EXPECT_EQ(hit.hit.primID, 0u);
    EXPECT_EQ(hit.hit.instID[0], kInvalid);
    // From below the normal is the same.
    EXPECT_EQ(trace(scene, make_ray({0.25f, 0.5f, -2}, {0, 0, 1})).hit.Ng_z, 1);
    EXPECT_TRUE(is_occluded(scene, down(0.25f, 0.5f)));
    EXPECT_FALSE(is_occluded(scene, down(0.75f, 0.5f)));
    rtcReleaseScene(scene);
}

TEST(DoorHits, MissesChangeNoBit) {
    const Door door;
    RTCScene scene = door.committed({door.triangle()});
    RTCRayHit ray = down(2, 2);
    ray.hit.u = 5;
    ray.ray.id = 7;
    const RTCRayHit after = trace(scene, ray);
    EXPECT_TRUE(are_same(ray, after));
    rtcReleaseScene(scene);
}

TEST(DoorHits, IntervalsAreOpenAtTnearUnlessTheSceneIsRobust) {
    const Door door;
    RTCScene scene = door.committed({door.triangle()});
    RTCScene robust = door.committed({door.triangle()}, RTC_SCENE_FLAG_ROBUST);
    const RTCRayHit at_tnear = make_ray({0.25f, 0.25f, 1}, {0, 0, -1}, 1);
    EXPECT_FALSE(is_occluded(scene, at_tnear));
    EXPECT_TRUE(is_occluded(robust, at_tnear));
    for (RTCScene each : {scene, robust}) {
        EXPECT_TRUE(is_occluded(each, make_ray({0.25f, 0.25f, 1}, {0, 0, -1}, 0, 1)));
        EXPECT_FALSE(is_occluded(each, make_ray({0.25f, 0.25f, 1}, {0, 0, -1}, 0, 0.99999994f)));
        EXPECT_FALSE(is_occluded(each, make_ray({0.25f, 0.25f, 0}, {0, 0, -1})));
        EXPECT_TRUE(is_occluded(each, make_ray({0.25f, 0.25f, 1}, {0, 0, -1}, -2)));
        EXPECT_FALSE(is_occluded(each, make_ray({0.25f, 0.25f, -1}, {0, 0, -1}, -2)));
        rtcReleaseScene(each);
    }
}

TEST(DoorHits, BadRaysHitNothingAndAreNoErrors) {
    const Door door;
    RTCScene scene = door.committed({door.triangle()});
    for (const RTCRayHit& bad :
         {make_ray({kNan, 0, 1}, {0, 0, -1}), make_ray({0.2f, 0.2f, 1}, {kNan, 0, -1}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, kNan),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 0, kNan),
          make_ray({0.2f, 0.2f, kInfinity}, {0, 0, -1}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -kInfinity}), make_ray({0.2f, 0.2f, 0}, {0, 0, 0}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 2, 0.5f),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 0, -1)}) {
        EXPECT_EQ(trace(scene, bad).hit.geomID, kInvalid);
        RTCRay ray = bad.ray;
        occluded1(scene, ray);
        EXPECT_EQ(std::memcmp(&ray, &bad.ray, sizeof ray), 0);
    }
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST(DoorHits, QuadsHaveOneIdAndOneSquareOfWeights) {
    const Door door;
    RTCScene scene = door.committed(
        {door.quads({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}},
                    {{{4, 5, 6, 6}}, {{0, 1, 2, 3}}})});
    for (const auto& [x, y] : {std::array{0.25f, 0.5f}, std::array{0.75f, 0.875f}}) {
        const RTCRayHit hit = trace(scene, down(x, y));
        EXPECT_EQ(hit.hit.primID, 1u);
        EXPECT_EQ(hit.hit.u, x);
        EXPECT_EQ(hit.hit.v, y);
        EXPECT_EQ(hit.hit.Ng_z, 1);
    }
    // A quad whose last corners are one is a triangle.
    EXPECT_EQ(trace(scene, down(5.25f, 0.5f)).hit.primID, 0u);
    EXPECT_EQ(trace(scene, down(5.75f, 0.5f)).hit.primID, kInvalid);
    rtcReleaseScene(scene);
}

TEST(DoorHits, TrianglesWithBadIndicesAndNansAreLeftOut) {
    const Door door;
    RTCScene scene =
        door.committed({door.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {kNan, 0, 0}},
                                       {{0, 1, 9}, {0, 1, 3}, {0xFFFFFFFFu, 1, 2}, {0, 1, 2}})});
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.primID, 3u);
    rtcReleaseScene(scene);
}

/// Writes a vertex of geometry 0, and commits.
void move_vertex(RTCScene scene, std::size_t vertex, Point to) {
    RTCGeometry mesh = rtcGetGeometry(scene, 0);
    static_cast<Point*>(rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0))[vertex] = to;
    rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(mesh);
    rtcCommitScene(scene);
}

TEST(DoorHits, QuadsWithABadVertexAreLeftOutWhole) {
    const Door door;
    const std::vector<Point> corners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}};
    for (const RTCSceneFlags flags : {RTC_SCENE_FLAG_NONE, RTC_SCENE_FLAG_DYNAMIC}) {
        RTCScene scene =
            door.committed({door.quads(corners, {{{0, 1, 2, 3}}, {{1, 4, 2, 2}}})}, flags);
        for (std::size_t bad = 0; bad < 4; ++bad) {
            for (const float z : {kNan, -kInfinity, 2e18f}) {
                move_vertex(scene, bad, {corners[bad][0], corners[bad][1], z});
                EXPECT_EQ(trace(scene, down(0.1f, 0.1f)).hit.primID, kInvalid) << bad;
                EXPECT_EQ(trace(scene, down(0.9f, 0.9f)).hit.primID, kInvalid) << bad;
                EXPECT_EQ(trace(scene, down(1.2f, 0.2f)).hit.primID, bad % 3 == 0 ? 1 : kInvalid);
                RTCBounds bounds;
                rtcGetSceneBounds(scene, &bounds);
                EXPECT_EQ(bounds.lower_x, bad % 3 == 0 ? 1 : kInfinity);
            }
            move_vertex(scene, bad, corners[bad]);
            for (const float x : {0.1f, 0.9f})
                EXPECT_EQ(trace(scene, down(x, x)).hit.primID, 0u) << bad;
        }
        EXPECT_EQ(door.error(), RTC_ERROR_NONE);
        rtcReleaseScene(scene);
    }
}

TEST(DoorHits, TrianglesTooFarAwayAreLeftOut) {
    const Door door;
    const auto expect_unit_triangle = [&](RTCScene scene) {
        const RTCRayHit hit = trace(scene, down(0.25f, 0.5f));
        EXPECT_EQ(hit.ray.tfar, 1);
        EXPECT_EQ(hit.hit.u, 0.25f);
        RTCBounds bounds;
        rtcGetSceneBounds(scene, &bounds);
        EXPECT_EQ(bounds.lower_x, 0);
        EXPECT_EQ(bounds.upper_x, 1);
        EXPECT_EQ(bounds.upper_z, 0);
    };
    for (const float far_x : {1.9e18f, 1e19f, 1e30f, -3e38f}) {
        RTCScene child = door.committed(
            {door.triangles({{far_x, 0, 0}, {1, 1, 0}, {0, 0, 1}}, {{0, 1, 2}}), door.triangle()});
        RTCGeometry instance = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, child);
        RTCScene scene = door.committed({instance});
        expect_unit_triangle(child);
        expect_unit_triangle(scene);
        rtcReleaseScene(scene);
        rtcReleaseScene(child);
    }
    // A particle of no size that is hidden far away, and comes back.
    for (const RTCSceneFlags flags : {RTC_SCENE_FLAG_NONE, RTC_SCENE_FLAG_DYNAMIC}) {
        RTCScene scene = door.committed(
            {door.triangles({{0, 0, -1}, {0, 0, -1}, {0, 0, -1}}, {{0, 1, 2}}), door.triangle()},
            flags);
        for (const float z : {1e30f, -1.0f, 1e30f, 1e25f}) {
            for (std::size_t i = 0; i < 3; ++i) move_vertex(scene, i, {0, 0, z});
            const RTCRayHit hit = trace(scene, down(0.25f, 0.5f));
            EXPECT_EQ(hit.hit.geomID, 1u) << z;
            EXPECT_EQ(hit.hit.u, 0.25f) << z;
        }
        EXPECT_EQ(door.error(), RTC_ERROR_NONE);
        rtcReleaseScene(scene);
    }
}

TEST(DoorHits, BoundsAreThoseOfTheCommit) {
    const Door door;
    std::vector<Point> vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<unsigned int> indices = {0, 1, 2};
    RTCGeometry mesh = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const auto share = [&](std::vector<Point>& positions) {
        rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   positions.data(), 0, sizeof(Point), 3);
    };
    share(vertices);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(), 0,
                               12, 1);
    RTCScene scene = door.committed({mesh});
    const auto upper_x = [&] {
        RTCBounds bounds;
        rtcGetSceneBounds(scene, &bounds);
        return bounds.upper_x;
    };
    // The next frame is written in place, and then in memory of its own.
    vertices[1][0] = 5;
    EXPECT_EQ(upper_x(), 1);
    std::vector<Point> next = vertices;
    share(next);
    vertices = {};
    EXPECT_EQ(upper_x(), 1);
    rtcCommitScene(scene);
    EXPECT_EQ(upper_x(), 5);
    next[1][0] = 6;
    rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
    EXPECT_EQ(upper_x(), 5);
    rtcCommitScene(scene);
    EXPECT_EQ(upper_x(), 6);
    rtcReleaseScene(scene);
}

TEST(DoorHits, VerticesBehindTheLastTriangleDoNotMatter) {
    const Door door;
    // They stretch no scene so far that the triangle is a point in it.
    RTCScene scene = door.committed(
        {door.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-3e38f, 2e38f, 1e38f}}, {{0, 1, 2}})});
    const RTCRayHit hit = trace(scene, down(0.25f, 0.5f));
    EXPECT_EQ(hit.hit.u, 0.25f);
    EXPECT_EQ(hit.hit.v, 0.5f);
    rtcReleaseScene(scene);
}

TEST(DoorHits, TiesGoToTheLowestIds) {
    const Door door;
    RTCScene scene = rtcNewScene(door.device);
    for (const unsigned int id : {7u, 3u, 100000u}) {
        RTCGeometry twice =
            door.triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 2}});
        rtcAttachGeometryByID(scene, twice, id);
        rtcReleaseGeometry(twice);
    }
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 3u);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.primID, 0u);
    rtcDetachGeometry(scene, 3);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 7u);
    rtcReleaseScene(scene);
}

TEST(DoorHits, StridesAndSharedBuffersAreRead) {
    const Door door;
    struct Vertex {
        float normal[3];
        Point position;
        float rest;
    };
    const std::vector<Vertex> vertices = {
        {{}, {0, 0, 0}, 0}, {{}, {1, 0, 0}, 0}, {{}, {0, 1, 0}, 0}};
    const std::vector<std::array<unsigned int, 5>> indices = {{9, 9, 0, 1, 2}};
    RTCGeometry mesh = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.data(),
                               12, sizeof(Vertex), vertices.size());
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(), 8,
                               20, 1);
    RTCScene scene = door.committed({mesh});
    EXPECT_EQ(trace(scene, down(0.25f, 0.5f)).hit.v, 0.5f);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST(DoorHits, BoundsAreThoseOfTriangles) {
    const Door door;
    // Two vertices belong to no triangle.
    RTCScene scene = door.committed(
        {door.triangles({{-1, 0, 0}, {1, 0, 2}, {9, 9, 9}, {0, 3, 0}, {9, 9, 9}}, {{0, 1, 3}})});
    RTCBounds bounds;
    rtcGetSceneBounds(scene, &bounds);
    EXPECT_EQ(bounds.lower_x, -1);
    EXPECT_EQ(bounds.upper_x, 1);
    EXPECT_EQ(bounds.upper_y, 3);
    EXPECT_EQ(bounds.upper_z, 2);
    RTCLinearBounds linear = {};
    rtcGetSceneLinearBounds(scene, &linear);
    for (const RTCBounds& each : {linear.bounds0, linear.bounds1}) {
        EXPECT_EQ(each.lower_x, -1);
        EXPECT_EQ(each.upper_z, 2);
    }
    rtcGetSceneLinearBounds(scene, nullptr);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_ARGUMENT);
    RTCScene empty = door.committed({});
    rtcGetSceneBounds(empty, &bounds);
    EXPECT_EQ(bounds.lower_x, kInfinity);
    EXPECT_EQ(bounds.upper_x, -kInfinity);
    EXPECT_EQ(trace(empty, down(0, 0)).hit.geomID, kInvalid);
    EXPECT_FALSE(is_occluded(empty, down(0, 0)));
    rtcReleaseScene(scene);
    rtcReleaseScene(empty);
}

TEST(DoorHits, AreTheSameForEveryNameOfAnInstructionSet) {
    const Waves waves(20);
    std::vector<RTCRayHit> first;
    for (const char* const settings : {"", "isa=sse2", "isa=sse4.2,threads=1", "isa=avx2",
                                       "isa=avx512,threads=2", "isa=avx,verbose=0"}) {
        const Door door(settings);
        ASSERT_NE(door.device, nullptr) << settings;
        RTCScene scene = door.committed({door.triangles(waves.vertices, waves.indices)});
        std::vector<RTCRayHit> hits;
        for (int i = 0; i < 400; ++i) {
            const auto t = static_cast<float>(i) / 400;
            hits.push_back(trace(scene, make_ray({t, 1 - t, 1}, {0.3f * t, 0.2f, -1})));
        }
        if (first.empty()) first = hits;
        for (std::size_t i = 0; i < hits.size(); ++i)
            EXPECT_TRUE(are_same(first[i], hits[i])) << settings << ", " << i;
        rtcReleaseScene(scene);
    }
}

TEST(DoorHits, SettingsChooseTheInstructionSetAndThreads) {
    const std::vector<std::string> have = morphray::simd_targets();
    const bool has_scalar = std::find(have.begin(), have.end(), "scalar") != have.end();
    const std::string sse2 = has_scalar ? "scalar" : "";
    const std::pair<const char*, morphray::CpuOptions> cases[] = {
        {"verbose=1,tri_accel=bvh4.triangle4", {}},
        {"threads=2,isa=sse2,verbose=1", {2, sse2}},
        {" Verbose = 2, MAX_ISA = SSE2 , threads = 1", {1, sse2}},
        {"isa=none,threads=-3,verbose=1", {}}};
    for (const auto& [settings, options] : cases) {
        testing::internal::CaptureStderr();
        { const Door door(settings); }
        EXPECT_EQ(
            testing::internal::GetCapturedStderr(),
            "morphray: in place of Embree, " + morphray::Device::cpu(options).description() + "\n")
            << settings;
    }
}

}  // namespace
}  // namespace mray
