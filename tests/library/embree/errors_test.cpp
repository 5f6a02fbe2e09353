// Errors, and hostile use.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <thread>

#include "tests/library/embree/door.h"

namespace mray {
namespace {

using namespace door_test;

TEST(DoorErrors, NullHandlesAreErrorsOfTheThread) {
    ASSERT_EQ(rtcGetDeviceError(nullptr), RTC_ERROR_NONE);
    const auto expect_error = [](const char* call) {
        EXPECT_EQ(rtcGetDeviceError(nullptr), RTC_ERROR_INVALID_ARGUMENT) << call;
    };
    rtcRetainDevice(nullptr), expect_error("rtcRetainDevice");
    rtcReleaseDevice(nullptr), expect_error("rtcReleaseDevice");
    rtcReleaseScene(nullptr), expect_error("rtcReleaseScene");
    rtcReleaseGeometry(nullptr), expect_error("rtcReleaseGeometry");
    rtcReleaseBuffer(nullptr), expect_error("rtcReleaseBuffer");
    EXPECT_EQ(rtcNewScene(nullptr), nullptr), expect_error("rtcNewScene");
    EXPECT_EQ(rtcNewGeometry(nullptr, RTC_GEOMETRY_TYPE_TRIANGLE), nullptr);
    expect_error("rtcNewGeometry");
    EXPECT_EQ(rtcNewBuffer(nullptr, 5), nullptr), expect_error("rtcNewBuffer");
    rtcCommitScene(nullptr), expect_error("rtcCommitScene");
    rtcJoinCommitScene(nullptr), expect_error("rtcJoinCommitScene");
    rtcCommitGeometry(nullptr), expect_error("rtcCommitGeometry");
    EXPECT_EQ(rtcAttachGeometry(nullptr, nullptr), kInvalid), expect_error("rtcAttachGeometry");
    rtcDetachGeometry(nullptr, 0), expect_error("rtcDetachGeometry");
    EXPECT_EQ(rtcGetGeometry(nullptr, 0), nullptr), expect_error("rtcGetGeometry");
    rtcSetGeometryMask(nullptr, 1), expect_error("rtcSetGeometryMask");
    rtcUpdateGeometryBuffer(nullptr, RTC_BUFFER_TYPE_VERTEX, 0);
    expect_error("rtcUpdateGeometryBuffer");
    EXPECT_EQ(rtcSetNewGeometryBuffer(nullptr, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3),
              nullptr);
    expect_error("rtcSetNewGeometryBuffer");
    rtcInterpolate(nullptr), expect_error("rtcInterpolate");
    rtcGetSceneBounds(nullptr, nullptr), expect_error("rtcGetSceneBounds");
    EXPECT_FALSE(rtcPointQuery(nullptr, nullptr, nullptr, nullptr, nullptr));
    expect_error("rtcPointQuery");
    RTCRayHit ray = down(0, 0);
    intersect1(nullptr, ray), expect_error("rtcIntersect1");
    occluded1(nullptr, ray.ray), expect_error("rtcOccluded1");
    RTCRayHit16* const none = nullptr;
    trace_packet(rtcIntersect16, nullptr, nullptr, none), expect_error("rtcIntersect16");

    const Door door;
    RTCScene scene = door.committed({door.triangle()});
    const auto expect_here = [&](const char* call) {
        EXPECT_EQ(door.error(), RTC_ERROR_INVALID_ARGUMENT) << call;
    };
    rtcAttachGeometry(scene, nullptr), expect_here("rtcAttachGeometry");
    trace_packet(rtcIntersect16, nullptr, scene, none), expect_here("rtcIntersect16");
    rtcGetSceneBounds(scene, nullptr), expect_here("rtcGetSceneBounds");
    rtcSetGeometryTransform(rtcGetGeometry(scene, 0), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, nullptr);
    expect_here("rtcSetGeometryTransform");
    rtcSetSharedGeometryBuffer(rtcGetGeometry(scene, 0), RTC_BUFFER_TYPE_VERTEX, 0,
                               RTC_FORMAT_FLOAT3, nullptr, 0, 12, 3);
    expect_here("rtcSetSharedGeometryBuffer");
    // A null context is none.
    Query query;
    query.is_bare = true;
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f), query).hit.geomID, 0u);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

struct Messages {
    std::vector<RTCError> codes;
    std::string last;
};
void note(void* user, RTCError code, const char* text) {
    auto& messages = *static_cast<Messages*>(user);
    messages.codes.push_back(code);
    messages.last = text;
}

TEST(DoorErrors, WhatIsNotSupportedIsNamed) {
    const Door door;
    Messages messages;
    rtcSetDeviceErrorFunction(door.device, note, &messages);
    const std::pair<RTCGeometryType, const char*> types[] = {
        {RTC_GEOMETRY_TYPE_GRID, "grids"},
        {RTC_GEOMETRY_TYPE_SUBDIVISION, "subdivision surfaces"},
        {RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE, "curves"},
        {RTC_GEOMETRY_TYPE_FLAT_LINEAR_CURVE, "curves"},
        {RTC_GEOMETRY_TYPE_SPHERE_POINT, "points"},
        {RTC_GEOMETRY_TYPE_USER, "user geometries"}};
    for (const auto& [type, name] : types) {
        // Programs write through the pointers of buffers, errors or not.
        RTCGeometry geometry = rtcNewGeometry(door.device, type);
        EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
        EXPECT_NE(messages.last.find(name), std::string::npos) << messages.last;
        auto* const data = static_cast<float*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, 5));
        ASSERT_NE(data, nullptr);
        data[19] = 1;
        EXPECT_EQ(rtcGetGeometryBufferData(geometry, RTC_BUFFER_TYPE_VERTEX, 0), data);
        rtcSetGeometryTessellationRate(geometry, 4);
        EXPECT_EQ(door.error(), RTC_ERROR_NONE);
        messages.last.clear();
        RTCScene scene = door.committed({door.triangle(), geometry});
        EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
        EXPECT_NE(messages.last.find(name), std::string::npos) << messages.last;
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, kInvalid);
        EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
        rtcRetainGeometry(geometry);
        rtcDetachGeometry(scene, 1);
        rtcCommitScene(scene);
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
        EXPECT_EQ(door.error(), RTC_ERROR_NONE);
        // A commit that is refused leaves no old answers.
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
        EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, kInvalid);
        EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
        rtcReleaseScene(scene);
    }
    rtcNewBVH(door.device);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
    RTCScene scene = door.committed({door.triangle()});
    rtcCollide(scene, scene, nullptr, nullptr);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
    rtcReleaseScene(scene);
}

TEST(DoorErrors, TheUserIsToldOnceOfScenesThatAreRefused) {
    // Programs may show no errors. In a process of its own, the first time.
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    EXPECT_EXIT(
        {
            for (int i = 0; i < 2; ++i) {
                const Door door;
                rtcReleaseScene(
                    door.committed({rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_GRID)}));
            }
            std::exit(0);
        },
        testing::ExitedWithCode(0),
        "^morphray: grids are not supported by morphray: no ray of such scenes "
        "hits\n$");
}

TEST(DoorErrors, MotionBlurIsRefusedUnlessNothingMoves) {
    const Door door;
    RTCGeometry mesh = door.triangle();
    rtcSetGeometryTimeStepCount(mesh, 2);
    auto* later = static_cast<Point*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 1,
                                                              RTC_FORMAT_FLOAT3, sizeof(Point), 3));
    later[0] = {0, 0, 0};
    later[1] = {1, 0, 0};
    later[2] = {0, 1, 0};
    RTCScene scene = door.committed({mesh});
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
    later[0][2] = 1;
    rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 1);
    rtcCommitScene(scene);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
    rtcReleaseScene(scene);
}

TEST(DoorErrors, TheFirstOneStaysUntilItIsTaken) {
    const Door door;
    rtcReleaseGeometry(rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_GRID));
    RTCScene scene = rtcNewScene(door.device);
    rtcAttachGeometry(scene, nullptr);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    // A thread has slots of its own.
    rtcAttachGeometry(scene, nullptr);
    std::thread([&] { EXPECT_EQ(door.error(), RTC_ERROR_NONE); }).join();
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_ARGUMENT);
    rtcReleaseScene(scene);
}

TEST(DoorErrors, BuffersAreChecked) {
    const Door door;
    RTCGeometry mesh = door.triangle();
    const float floats[16] = {};
    const auto set = [&](RTCBufferType type, unsigned int slot, RTCFormat format,
                         std::size_t offset, std::size_t stride) {
        rtcSetSharedGeometryBuffer(mesh, type, slot, format, floats, offset, stride, 1);
        return door.error();
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
    EXPECT_EQ(door.error(), RTC_ERROR_OUT_OF_MEMORY);
    RTCBuffer buffer = rtcNewBuffer(door.device, 3 * sizeof(Point));
    const auto take = [&](std::size_t offset, std::size_t count) {
        rtcSetGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, buffer, offset,
                             sizeof(Point), count);
        return door.error();
    };
    EXPECT_EQ(take(0, 3), RTC_ERROR_NONE);
    EXPECT_EQ(take(0, 4), RTC_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(take(sizeof(Point), 3), RTC_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(take(4 * sizeof(Point), 0), RTC_ERROR_INVALID_ARGUMENT);
    rtcReleaseBuffer(buffer);
    rtcReleaseGeometry(mesh);
}

TEST(DoorErrors, CallsThatAnObjectDoesNotTakeAreInvalidOperations) {
    const Door door;
    RTCScene scene = door.committed({door.triangle()});
    RTCGeometry mesh = rtcGetGeometry(scene, 0);
    RTCGeometry instance = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
    const auto expect_error = [&](const char* call) {
        EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION) << call;
    };
    float matrix[16] = {};
    constexpr RTCFormat kMatrix = RTC_FORMAT_FLOAT4X4_ROW_MAJOR;
    rtcAttachGeometryByID(scene, mesh, 0), expect_error("a taken ID");
    rtcDetachGeometry(scene, 7), expect_error("an ID of no geometry");
    rtcSetGeometryTransform(mesh, 0, kMatrix, matrix), expect_error("a mesh's transformation");
    rtcGetGeometryTransform(mesh, 0, kMatrix, matrix), expect_error("a mesh's transformation");
    rtcSetGeometryInstancedScene(mesh, scene), expect_error("a mesh's scene");
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3, matrix), expect_error("no matrix");
    rtcSetGeometryTransform(instance, 1, kMatrix, matrix), expect_error("a time step");
    rtcSetGeometryVertexAttributeCount(instance, 1), expect_error("an instance's attributes");
    rtcSetGeometryIntersectFilterFunction(instance, nullptr), expect_error("a filter of hits");
    rtcSetGeometryOccludedFilterFunction(instance, nullptr), expect_error("a filter of shadows");
    rtcReleaseGeometry(instance);
    rtcReleaseScene(scene);
}

TEST(DoorErrors, ObjectsOfAnotherDeviceAreRefused) {
    const Door door;
    const Door other;
    RTCScene scene = door.committed({});
    RTCGeometry mesh = other.triangle();
    EXPECT_EQ(rtcAttachGeometry(scene, mesh), kInvalid);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_ARGUMENT);
    rtcAttachGeometryByID(scene, mesh, 3);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(rtcGetGeometry(scene, 3), nullptr);
    RTCBuffer buffer = rtcNewBuffer(door.device, 36);
    rtcSetGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, buffer, 0, 12, 3);
    EXPECT_EQ(other.error(), RTC_ERROR_INVALID_ARGUMENT);
    rtcReleaseBuffer(buffer);
    rtcReleaseGeometry(mesh);
    rtcReleaseScene(scene);
}

TEST(DoorErrors, ARangeOfTimesDoesNotEndBeforeItBegins) {
    const Door door;
    RTCGeometry mesh = door.triangle();
    rtcSetGeometryTimeRange(mesh, 0.5f, 0.5f);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcSetGeometryTimeRange(mesh, 1, 0);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_ARGUMENT);
    rtcReleaseGeometry(mesh);
}

bool refuse(void*, double) { return false; }

TEST(DoorErrors, ScenesThatAreNotCommittedAnswerNothing) {
    const Door door;
    RTCScene scene = door.scene({door.triangle()});
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, kInvalid);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
    EXPECT_FALSE(is_occluded(scene, down(0.25f, 0.25f)));
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
    rtcSetSceneProgressMonitorFunction(scene, refuse, nullptr);
    rtcDisableGeometry(rtcGetGeometry(scene, 0));
    rtcCommitScene(scene);
    EXPECT_EQ(door.error(), RTC_ERROR_CANCELLED);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, kInvalid);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_OPERATION);
    rtcReleaseScene(scene);
}

TEST(DoorErrors, ObjectsMayBeReleasedInAnyOrder) {
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

TEST(DoorErrors, AScenesInstanceOfItselfIsRefused) {
    const Door door;
    RTCScene scene = rtcNewScene(door.device);
    RTCGeometry instance = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, scene);
    rtcAttachGeometry(scene, instance);
    rtcCommitScene(scene);
    EXPECT_EQ(door.error(), RTC_ERROR_INVALID_ARGUMENT);
    rtcDetachGeometry(scene, 0);
    rtcReleaseGeometry(instance);
    rtcReleaseScene(scene);
}

}  // namespace
}  // namespace mray
