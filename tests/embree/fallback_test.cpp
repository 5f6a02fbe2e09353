// MORPHRAY_EMBREE_FALLBACK: scenes with other geometries are answered by Embree's own library.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#include "tests/embree/door.h"

namespace mray {
namespace {

using namespace door_test;

constexpr const char* kVariable = "MORPHRAY_EMBREE_FALLBACK";

class DoorFallback : public testing::Test {
protected:
    DoorFallback() { setenv(kVariable, EMBREE_LIBRARY, 1); }
    ~DoorFallback() override { unsetenv(kVariable); }
};

/// A scene's user geometry: a square of side 2 at z = 0, and a function that sees its user data.
struct Square {
    int intersected = 0;
    RTCGeometry make(RTCDevice device) {
        RTCGeometry made = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(made, 1);
        rtcSetGeometryUserData(made, this);
        rtcSetGeometryBoundsFunction(made, bounds, nullptr);
        rtcSetGeometryIntersectFunction(made, intersect);
        return made;
    }
    static void bounds(const RTCBoundsFunctionArguments* arguments) {
        *arguments->bounds_o = {-1, -1, 0, 0, 1, 1, 0, 0};
    }
    static void intersect(const RTCIntersectFunctionNArguments* arguments) {
        ++static_cast<Square*>(arguments->geometryUserPtr)->intersected;
        auto* const ray = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
        const float t = -ray->ray.org_z / ray->ray.dir_z;
        if (t < ray->ray.tnear || t > ray->ray.tfar) return;
        ray->ray.tfar = t;
        ray->hit.geomID = arguments->geomID;
        ray->hit.primID = arguments->primID;
        ray->hit.instID[0] = arguments->context->instID[0];
    }
};

RTCGeometry sphere(const Door& door, Point at, float radius) {
    RTCGeometry made = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    auto* const data = static_cast<float*>(
        rtcSetNewGeometryBuffer(made, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, 1));
    std::copy(at.begin(), at.end(), data);
    data[3] = radius;
    return made;
}

TEST_F(DoorFallback, ScenesWithOtherGeometriesAreAnswered) {
    const Door door;
    testing::internal::CaptureStderr();
    RTCScene scene = door.committed({door.triangle(-1), sphere(door, {0.25f, 0.25f, 0}, 0.1f)});
    RTCScene second = door.committed({sphere(door, {0, 0, 0}, 1)});
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_NE(said.find("points are not supported by morphray"), std::string::npos) << said;
    EXPECT_NE(said.find(EMBREE_LIBRARY), std::string::npos) << said;
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    const RTCRayHit hit = trace(scene, down(0.25f, 0.25f));
    EXPECT_EQ(hit.hit.geomID, 1u);
    EXPECT_NEAR(hit.ray.tfar, 0.9f, 1e-5f);
    EXPECT_EQ(trace(scene, down(0.5f, 0.25f)).hit.geomID, 0u);
    EXPECT_TRUE(is_occluded(scene, down(0.25f, 0.25f)));
    EXPECT_NEAR(trace(second, down(0, 0, 3)).ray.tfar, 2, 1e-5f);
    RTCBounds bounds;
    rtcGetSceneBounds(second, &bounds);
    EXPECT_NEAR(bounds.upper_z, 1, 1e-5f);
    EXPECT_EQ(rtcGetDeviceProperty(door.device, RTC_DEVICE_PROPERTY_POINT_GEOMETRY_SUPPORTED), 1);
    // Without the sphere the scene is ours again: a ray that starts on the triangle misses it.
    RTCGeometry gone = rtcGetGeometry(scene, 1);
    rtcDisableGeometry(gone);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).ray.tfar, 2);
    rtcEnableGeometry(gone);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 1u);
    rtcDetachGeometry(scene, 1);
    rtcCommitScene(scene);
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
    rtcReleaseScene(second);
}

TEST_F(DoorFallback, TheTwinReadsTheBuffersAndMasksOfTheCaller) {
    const Door door;
    RTCGeometry mesh = door.triangle(-1);
    rtcSetGeometryMask(mesh, 2);
    RTCScene scene = door.committed({mesh, sphere(door, {9, 9, 0}, 0.1f)}, RTC_SCENE_FLAG_DYNAMIC);
    EXPECT_EQ(trace(scene, make_ray({0.25f, 0.25f, 1}, {0, 0, -1}, 0, kInfinity, 1)).hit.geomID,
              kInvalid);
    EXPECT_EQ(trace(scene, make_ray({0.25f, 0.25f, 1}, {0, 0, -1}, 0, kInfinity, 2)).hit.geomID,
              0u);
    auto* const points = static_cast<Point*>(
        rtcGetGeometryBufferData(rtcGetGeometry(scene, 0), RTC_BUFFER_TYPE_VERTEX, 0));
    for (int i = 0; i < 3; ++i) points[i][2] = -3;
    rtcUpdateGeometryBuffer(rtcGetGeometry(scene, 0), RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(rtcGetGeometry(scene, 0));
    rtcCommitScene(scene);
    // Embree's own answer, whose last bits differ from processor to processor.
    EXPECT_NEAR(trace(scene, down(0.25f, 0.25f)).ray.tfar, 4, 1e-5);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST_F(DoorFallback, CallbacksSeeTheDataOfTheCaller) {
    const Door door;
    Square square;
    RTCScene child = door.committed({square.make(door.device)});
    RTCGeometry instance = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, child);
    const float raise[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 5};
    rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, raise);
    RTCScene scene = door.committed({door.triangle(), instance});
    rtcReleaseScene(child);
    const RTCRayHit hit = trace(scene, down(0.25f, 0.25f, 9));
    EXPECT_EQ(hit.ray.tfar, 4);
    EXPECT_EQ(hit.hit.instID[0], 1u);
    EXPECT_EQ(square.intersected, 1);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST_F(DoorFallback, MotionBlurIsAnswered) {
    const Door door;
    RTCGeometry mesh = door.triangle();
    rtcSetGeometryTimeStepCount(mesh, 2);
    auto* later = static_cast<Point*>(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 1,
                                                              RTC_FORMAT_FLOAT3, sizeof(Point), 3));
    later[0] = {0, 0, -2};
    later[1] = {1, 0, -2};
    later[2] = {0, 1, -2};
    RTCScene scene = door.committed({mesh});
    RTCRayHit ray = down(0.25f, 0.25f);
    ray.ray.time = 0.5f;
    EXPECT_NEAR(trace(scene, ray).ray.tfar, 2, 1e-5f);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

std::vector<RTCGeometry> displaced;
void displace(const RTCDisplacementFunctionNArguments* arguments) {
    displaced.push_back(arguments->geometry);
}

TEST_F(DoorFallback, SubdivisionSurfacesAreAskedByOurHandles) {
    const Door door;
    RTCGeometry surface = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_SUBDIVISION);
    const std::vector<Point> corners = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const unsigned int indices[] = {0, 1, 2, 3};
    const unsigned int face = 4;
    rtcSetSharedGeometryBuffer(surface, RTC_BUFFER_TYPE_FACE, 0, RTC_FORMAT_UINT, &face, 0, 4, 1);
    rtcSetSharedGeometryBuffer(surface, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, indices, 0, 4,
                               4);
    auto* const points = static_cast<Point*>(rtcSetNewGeometryBuffer(
        surface, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Point), 4));
    std::copy(corners.begin(), corners.end(), points);
    rtcSetGeometrySubdivisionMode(surface, 0, RTC_SUBDIVISION_MODE_PIN_ALL);
    displaced.clear();
    rtcSetGeometryDisplacementFunction(surface, displace);
    RTCScene scene = door.committed({surface});
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
    ASSERT_FALSE(displaced.empty());
    EXPECT_EQ(displaced.front(), surface);
    EXPECT_EQ(rtcGetGeometryFirstHalfEdge(surface, 0), 0u);
    EXPECT_EQ(rtcGetGeometryNextHalfEdge(surface, 0), 1u);
    float p[3];
    rtcInterpolate0(surface, 0, 0.5f, 0.5f, RTC_BUFFER_TYPE_VERTEX, 0, p, 3);
    EXPECT_NEAR(p[0], 0.5f, 1e-5f);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST_F(DoorFallback, ErrorsOfTheLibraryAreTheDevices) {
    const Door door;
    RTCGeometry curve = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_ROUND_BSPLINE_CURVE);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcSetNewGeometryBuffer(curve, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_UINT3, 12, 4);
    EXPECT_NE(door.error(), RTC_ERROR_NONE);
    rtcReleaseGeometry(curve);
    rtcReleaseBVH(rtcNewBVH(door.device));
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    EXPECT_EQ(rtcGetDeviceError(nullptr), RTC_ERROR_NONE);
}

/// The functions of a tree that only counts its primitives.
int* new_count(RTCThreadLocalAllocator allocator, int count) {
    void* const memory = rtcThreadLocalAlloc(allocator, sizeof(int), 16);
    return new (memory) int(count);
}
void* create_node(RTCThreadLocalAllocator allocator, unsigned int, void*) {
    return new_count(allocator, 0);
}
void set_children(void* node, void** children, unsigned int count, void*) {
    for (unsigned int i = 0; i < count; ++i)
        *static_cast<int*>(node) += *static_cast<const int*>(children[i]);
}
void set_bounds(void*, const RTCBounds**, unsigned int, void*) {}
void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive*, size_t count,
                  void*) {
    return new_count(allocator, static_cast<int>(count));
}

TEST_F(DoorFallback, BuildsTreesOfTheCaller) {
    const Door door;
    std::vector<RTCBuildPrimitive> prims;
    for (unsigned int i = 0; i < 100; ++i) {
        const auto x = static_cast<float>(i);
        prims.push_back({x, 0, 0, 0, x + 1, 1, 1, i});
    }
    RTCBVH bvh = rtcNewBVH(door.device);
    RTCBuildArguments arguments = rtcDefaultBuildArguments();
    arguments.byteSize = sizeof arguments;
    arguments.maxLeafSize = 4;
    arguments.bvh = bvh;
    arguments.primitives = prims.data();
    arguments.primitiveCount = arguments.primitiveArrayCapacity = prims.size();
    arguments.createNode = create_node;
    arguments.setNodeChildren = set_children;
    arguments.setNodeBounds = set_bounds;
    arguments.createLeaf = create_leaf;
    const void* const root = rtcBuildBVH(&arguments);
    ASSERT_NE(root, nullptr);
    EXPECT_EQ(*static_cast<const int*>(root), 100);
    rtcRetainBVH(bvh);
    rtcReleaseBVH(bvh);
    rtcReleaseBVH(bvh);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    EXPECT_EQ(rtcGetDeviceError(nullptr), RTC_ERROR_NONE);
}

TEST(DoorFallbackErrors, AFileThatIsNoLibraryMakesNoDevice) {
    // Each in a process of its own, which loads one library.
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    for (const char* const path : {"/no/such/library.so", EMBREE_HEADERS, OUR_LIBRARY}) {
        EXPECT_EXIT(
            {
                setenv(kVariable, path, 1);
                if (rtcNewDevice(nullptr) == nullptr &&
                    rtcGetDeviceError(nullptr) == RTC_ERROR_INVALID_ARGUMENT)
                    std::exit(5);
                std::exit(0);
            },
            testing::ExitedWithCode(5), "morphray: MORPHRAY_EMBREE_FALLBACK: ");
    }
}

}  // namespace
}  // namespace mray
