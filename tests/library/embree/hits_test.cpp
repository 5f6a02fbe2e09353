// Hits of triangles and quads, intervals of rays, and rays that hit nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "morphray/device.hpp"
#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

TEST(EmbreeHits, HaveTheNormalAndWeightsOfEmbree) {
    const TestDevice device;
    RTCScene scene = device.committed({device.triangle()});
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

TEST(EmbreeHits, MissesAndBadRaysChangeNoBitAndAreNoErrors) {
    const TestDevice device;
    RTCScene scene = device.committed({device.triangle()});
    for (const RTCRayHit& bad :
         {make_ray({kNan, 0, 1}, {0, 0, -1}), make_ray({0.2f, 0.2f, 1}, {kNan, 0, -1}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, kNan),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 0, kNan),
          make_ray({0.2f, 0.2f, kInfinity}, {0, 0, -1}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -kInfinity}), make_ray({0.2f, 0.2f, 0}, {0, 0, 0}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 2, 0.5f),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 0, -1), down(2, 2)}) {
        EXPECT_TRUE(are_same(trace(scene, bad), bad));
        RTCRay ray = bad.ray;
        occluded1(scene, ray);
        EXPECT_EQ(std::memcmp(&ray, &bad.ray, sizeof ray), 0);
    }
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST(EmbreeHits, StridesAndSharedBuffersAreRead) {
    const TestDevice device;
    struct Vertex {
        float normal[3];
        Point position;
        float rest;
    };
    const std::vector<Vertex> vertices = {
        {{}, {0, 0, 0}, 0}, {{}, {1, 0, 0}, 0}, {{}, {0, 1, 0}, 0}};
    const std::vector<std::array<unsigned int, 5>> indices = {{9, 9, 0, 1, 2}};
    RTCGeometry mesh = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.data(),
                               12, sizeof(Vertex), vertices.size());
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(), 8,
                               20, 1);
    RTCScene scene = device.committed({mesh});
    EXPECT_EQ(trace(scene, down(0.25f, 0.5f)).hit.v, 0.5f);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST(EmbreeHits, BoundsAreThoseOfTriangles) {
    const TestDevice device;
    // Two vertices belong to no triangle. They stretch no scene so far that the triangle is a
    // point.
    RTCScene scene = device.committed({device.triangles(
        {{-1, 0, 0}, {1, 0, 2}, {9, 9, 9}, {0, 3, 0}, {-3e38f, 2e38f, 1e38f}}, {{0, 1, 3}})});
    const RTCRayHit hit = trace(scene, down(0, 1, 3));
    EXPECT_NEAR(hit.hit.v, 1 / 3.0f, 1e-6f);
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
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_ARGUMENT);
    RTCScene empty = device.committed({});
    rtcGetSceneBounds(empty, &bounds);
    EXPECT_EQ(bounds.lower_x, kInfinity);
    EXPECT_EQ(bounds.upper_x, -kInfinity);
    EXPECT_EQ(trace(empty, down(0, 0)).hit.geomID, kInvalid);
    EXPECT_FALSE(is_occluded(empty, down(0, 0)));
    rtcReleaseScene(scene);
    rtcReleaseScene(empty);
}

}  // namespace
}  // namespace mray
