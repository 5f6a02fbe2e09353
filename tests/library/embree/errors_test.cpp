// Errors, and hostile use.
#include <gtest/gtest.h>

#include <cstdint>
#include <thread>

#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

struct Messages {
    std::vector<RTCError> codes;
    std::string last;
};
void note(void* user, RTCError code, const char* text) {
    auto& messages = *static_cast<Messages*>(user);
    messages.codes.push_back(code);
    messages.last = text;
}

TEST(EmbreeErrors, WhatIsNotSupportedIsNamed) {
    const TestDevice device;
    Messages messages;
    rtcSetDeviceErrorFunction(device.handle, note, &messages);
    const std::pair<RTCGeometryType, const char*> types[] = {
        {RTC_GEOMETRY_TYPE_GRID, "grids"},
        {RTC_GEOMETRY_TYPE_SUBDIVISION, "subdivision surfaces"},
        {RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE, "curves"},
        {RTC_GEOMETRY_TYPE_FLAT_LINEAR_CURVE, "curves"},
        {RTC_GEOMETRY_TYPE_SPHERE_POINT, "points"},
        {RTC_GEOMETRY_TYPE_USER, "user geometries"}};
    for (const auto& [type, name] : types) {
        // Programs write through the pointers of buffers, errors or not.
        RTCGeometry geometry = rtcNewGeometry(device.handle, type);
        EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
        EXPECT_NE(messages.last.find(name), std::string::npos) << messages.last;
        auto* const data = static_cast<float*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, 5));
        ASSERT_NE(data, nullptr);
        data[19] = 1;
        EXPECT_EQ(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0), data);
        rtcSetGeometryTessellationRate(geometry, 4);
        EXPECT_EQ(device.error(), RTC_ERROR_NONE);
        messages.last.clear();
        RTCScene scene = device.committed({device.triangle(), geometry});
        EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
        EXPECT_NE(messages.last.find(name), std::string::npos) << messages.last;
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, kInvalid);
        EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
        rtcRetainGeometry(geometry);
        rtcDetachGeometry(scene, 1);
        rtcCommitScene(scene);
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
        EXPECT_EQ(device.error(), RTC_ERROR_NONE);
        // A commit that is refused leaves no old answers.
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, kInvalid);
        EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    }
    rtcNewBVH(device.handle);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    RTCGeometry mesh = device.triangle();
    EXPECT_EQ(rtcGetGeometryFirstHalfEdge(mesh, 0), kInvalid);
    RTCScene scene = device.committed({mesh});
    rtcCollide(scene, scene, nullptr, nullptr);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    rtcPointQuery4(nullptr, scene, nullptr, nullptr, nullptr, nullptr);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
#if MORPHRAY_EMBREE == 3
    rtcIntersectNp(scene, nullptr, nullptr, 1);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
#endif
}

TEST(EmbreeErrors, MotionBlurIsRefused) {
    const TestDevice device;
    RTCGeometry mesh = device.triangle();
    RTCScene scene = device.committed({mesh});
    rtcSetGeometryTimeStepCount(mesh, 2);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    EXPECT_NE(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 1, RTC_FORMAT_FLOAT3, 12, 3),
              nullptr);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
    rtcCommitScene(scene);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    rtcSetGeometryTimeStepCount(mesh, 1);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
}

TEST(EmbreeErrors, TheFirstOneStaysUntilItIsTaken) {
    const TestDevice device;
    rtcReleaseGeometry(rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_GRID));
    RTCScene scene = device.scene({});
    rtcAttachGeometry(scene, nullptr);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
    // A thread has slots of its own.
    rtcAttachGeometry(scene, nullptr);
    std::thread([&] { EXPECT_EQ(device.error(), RTC_ERROR_NONE); }).join();
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_ARGUMENT);
}

TEST(EmbreeErrors, BuffersAreChecked) {
    const TestDevice device;
    RTCGeometry mesh = device.triangle();
    const float floats[16] = {};
    const auto set = [&](RTCBufferType type, unsigned int slot, RTCFormat format,
                         std::size_t offset, std::size_t stride) {
        rtcSetSharedGeometryBuffer(mesh, type, slot, format, floats, offset, stride, 1);
        return device.error();
    };
    EXPECT_EQ(set(RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 1, 12),
              RTC_ERROR_INVALID_OPERATION);
    EXPECT_EQ(set(RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 0, 13),
              RTC_ERROR_INVALID_OPERATION);
    EXPECT_EQ(set(RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 0, 16),
              RTC_ERROR_INVALID_OPERATION);
    EXPECT_EQ(set(RTC_BUFFER_TYPE_VERTEX, 1, RTC_FORMAT_FLOAT3, 0, 12), RTC_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(set(RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 0, 16), RTC_ERROR_INVALID_OPERATION);
    EXPECT_EQ(set(RTC_BUFFER_TYPE_LEVEL, 0, RTC_FORMAT_FLOAT, 0, 4), RTC_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                      SIZE_MAX / 4),
              nullptr);
    EXPECT_EQ(device.error(), RTC_ERROR_OUT_OF_MEMORY);
    RTCBuffer buffer = rtcNewBuffer(device.handle, 3 * sizeof(Point));
    const auto take = [&](std::size_t offset, std::size_t count) {
        rtcSetGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, buffer, offset,
                             sizeof(Point), count);
        return device.error();
    };
    EXPECT_EQ(take(0, 3), RTC_ERROR_NONE);
    EXPECT_EQ(take(0, 4), RTC_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(take(sizeof(Point), 3), RTC_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(take(4 * sizeof(Point), 0), RTC_ERROR_INVALID_ARGUMENT);
    rtcReleaseBuffer(buffer);
    rtcReleaseGeometry(mesh);
}

TEST(EmbreeErrors, ScenesThatAreNotCommittedAnswerNothing) {
    const TestDevice device;
    RTCScene scene = device.scene({device.triangle()});
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, kInvalid);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    EXPECT_FALSE(is_occluded(scene, down(0.25f, 0.25f)));
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
}

TEST(EmbreeErrors, ObjectsMayBeReleasedInAnyOrder) {
    RTCDevice device = rtcNewDevice("");
    RTCScene child = rtcNewScene(device);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    RTCBuffer buffer = rtcNewBuffer(device, 36);
    const Point points[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    std::memcpy(rtcGetBufferData(buffer), points, 36);
    rtcSetGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, buffer, 0, 12, 3);
    auto* const ids = static_cast<unsigned int*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 1));
    ids[0] = 0, ids[1] = 1, ids[2] = 2;
    RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, child);
    RTCScene scene = rtcNewScene(device);
    rtcReleaseDevice(device);
    rtcReleaseBuffer(buffer);
    rtcAttachGeometry(child, mesh);
    rtcReleaseGeometry(mesh);
    rtcReleaseScene(child);
    rtcAttachGeometry(scene, instance);
    rtcReleaseGeometry(instance);
    rtcCommitScene(scene);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.instID[0], 0u);
    rtcDetachGeometry(scene, 0);
    // Hits of the last commit still know their mesh.
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.Ng_z, 1);
    rtcReleaseScene(scene);
}

TEST(EmbreeErrors, InstancesOfScenesWithInstancesAreRefused) {
    const TestDevice device;
    RTCScene scene = device.scene({});
    RTCGeometry instance = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, scene);
    rtcAttachGeometry(scene, instance);
    rtcCommitScene(scene);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
    rtcDetachGeometry(scene, 0);
    rtcReleaseGeometry(instance);
}

}  // namespace
}  // namespace mray
