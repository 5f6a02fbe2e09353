// Commits: updates, refits, geometries that come and go, instances.
#include <gtest/gtest.h>

#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

TEST(EmbreeScenes, PositionsWrittenInPlaceAreSeenAfterBothCommits) {
    const TestDevice device;
    RTCGeometry mesh = device.triangle();
    RTCScene scene = device.committed({mesh});
    for (const float z : {-1.0f, -2.0f, -3.0f}) {
        auto* const points =
            static_cast<Point*>(rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0));
        for (int i = 0; i < 3; ++i) points[i][2] = z;
        if (z == -2) rtcSetGeometryMask(mesh, kInvalid);
        rtcCommitGeometry(mesh);
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).ray.tfar, -z);
        rtcCommitScene(scene);
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).ray.tfar, 1 - z);
    }
}

TEST(EmbreeScenes, NewBuffersReplaceTheOldOnes) {
    const TestDevice device;
    RTCScene scene = device.committed({device.triangle()});
    const std::vector<Point> moved = {{0, 0, -4}, {1, 0, -4}, {0, 1, -4}};
    rtcSetSharedGeometryBuffer(rtcGetGeometry(scene, 0), RTC_BUFFER_TYPE_VERTEX, 0,
                               RTC_FORMAT_FLOAT3, moved.data(), 0, sizeof(Point), 3);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).ray.tfar, 5);
    RTCBuffer buffer = rtcNewBuffer(device.handle, 3 * sizeof(Point));
    std::memcpy(rtcGetBufferData(buffer), moved.data(), 3 * sizeof(Point));
    static_cast<Point*>(rtcGetBufferData(buffer))[0][2] = 0;
    rtcSetGeometryBuffer(rtcGetGeometry(scene, 0), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                         buffer, 0, sizeof(Point), 3);
    rtcReleaseBuffer(buffer);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0, 0)).ray.tfar, 1);
}

TEST(EmbreeScenes, InstancesTakeAllLayoutsOfTransformations) {
    const TestDevice device;
    RTCScene child = device.committed({device.triangle(), device.triangle(-1)});
    // x and y change places, everything is twice as large and moved by (10, 20, 30).
    const std::vector<float> rows = {0, 2, 0, 10, 2, 0, 0, 20, 0, 0, 2, 30};
    const std::vector<float> columns = {0, 2, 0, 2, 0, 0, 0, 0, 2, 10, 20, 30};
    std::vector<float> rows4 = rows;
    rows4.insert(rows4.end(), {0, 0, 0, 1});
    const std::vector<float> columns4 = {0, 2, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0, 10, 20, 30, 1};
    const std::pair<RTCFormat, std::vector<float>> layouts[] = {
        {RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows},
        {RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns},
        {RTC_FORMAT_FLOAT4X4_ROW_MAJOR, rows4},
        {RTC_FORMAT_FLOAT4X4_COLUMN_MAJOR, columns4}};
    for (const auto& [format, floats] : layouts) {
        RTCScene scene = instance_of(device, child, format, floats);
        const RTCRayHit hit = trace(scene, down(11, 20.5f, 40));
        EXPECT_EQ(hit.ray.tfar, 10);
        EXPECT_EQ(hit.hit.instID[0], 1u);
        EXPECT_EQ(hit.hit.geomID, 0u);
        EXPECT_EQ(hit.hit.u, 0.25f);
        EXPECT_EQ(hit.hit.v, 0.5f);
        // In the space of the child.
        EXPECT_EQ(hit.hit.Ng_z, 1);
        std::vector<float> read(floats.size());
        rtcGetGeometryTransform(rtcGetGeometry(scene, 1), 0, format, read.data());
        EXPECT_EQ(read, floats);
    }
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
}

TEST(EmbreeScenes, MovedInstancesAreFollowed) {
    const TestDevice device;
    RTCScene child = device.committed({device.triangle()});
    // A quarter turn about z, then up.
    std::vector<float> turned = {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 2};
    constexpr RTCFormat kFormat = RTC_FORMAT_FLOAT3X4_ROW_MAJOR;
    RTCScene scene = instance_of(device, child, kFormat, turned);
    EXPECT_EQ(trace(scene, down(-0.5f, 0.25f, 3)).ray.tfar, 1);
    turned[11] = 1;
    RTCGeometry instance = rtcGetGeometry(scene, 1);
    rtcSetGeometryTransform(instance, 0, kFormat, turned.data());
    rtcCommitGeometry(instance);
    rtcCommitScene(scene);
    const RTCRayHit hit = trace(scene, down(-0.5f, 0.25f, 3));
    EXPECT_EQ(hit.ray.tfar, 2);
    EXPECT_EQ(hit.hit.u, 0.25f);
    EXPECT_EQ(hit.hit.instID[0], 1u);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
}

}  // namespace
}  // namespace mray
