// Scenes and rays by Embree's interface, of version 3 or 4.
#pragma once

#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace mray::embree_test {

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();
inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
inline constexpr unsigned int kInvalid = RTC_INVALID_GEOMETRY_ID;

#if MORPHRAY_EMBREE == 3
using Context = RTCIntersectContext;
#else
using Context = RTCRayQueryContext;
#endif

/// The arguments of a query beside its rays, the same for both versions.
struct Query {
    Context context;
    RTCFilterFunctionN filter = nullptr;
    /// Null context and arguments.
    bool is_bare = false;

    Query() {
#if MORPHRAY_EMBREE == 3
        rtcInitIntersectContext(&context);
#else
        rtcInitRayQueryContext(&context);
#endif
    }
};

#if MORPHRAY_EMBREE == 3

inline void intersect1(RTCScene scene, RTCRayHit& ray, Query query = {}) {
    query.context.filter = query.filter;
    rtcIntersect1(scene, query.is_bare ? nullptr : &query.context, &ray);
}
inline void occluded1(RTCScene scene, RTCRay& ray, Query query = {}) {
    query.context.filter = query.filter;
    rtcOccluded1(scene, query.is_bare ? nullptr : &query.context, &ray);
}
/// `function` is rtcIntersect4 to rtcOccluded16.
template <class Function, class Packet>
void trace_packet(Function function, const int* valid, RTCScene scene, Packet* packet) {
    Query query;
    function(valid, scene, &query.context, packet);
}

#else

inline void intersect1(RTCScene scene, RTCRayHit& ray, Query query = {}) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.context = &query.context;
    arguments.filter = query.filter;
    arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
    rtcIntersect1(scene, &ray, query.is_bare ? nullptr : &arguments);
}
inline void occluded1(RTCScene scene, RTCRay& ray, Query query = {}) {
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &query.context;
    arguments.filter = query.filter;
    arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
    rtcOccluded1(scene, &ray, query.is_bare ? nullptr : &arguments);
}
template <class Function, class Packet>
void trace_packet(Function function, const int* valid, RTCScene scene, Packet* packet) {
    function(valid, scene, packet, nullptr);
}

#endif

using Point = std::array<float, 3>;

/// The members of a ray, and of a ray with its hit, of 4 bytes each. Version 4 has bytes behind
/// them.
inline constexpr std::size_t kRayMembers = 12;
inline constexpr std::size_t kMembers = MORPHRAY_EMBREE == 3 ? 20 : 21;

/// Whether all members have the same bits.
inline bool are_same(const RTCRayHit& a, const RTCRayHit& b) {
    return std::memcmp(&a, &b, 4 * kMembers) == 0;
}

/// Stores a ray, with its hit if `members` counts them, as lane i of a packet of n.
inline void store_lane(const void* ray, void* packet, std::size_t n, std::size_t i,
                       std::size_t members = kMembers) {
    for (std::size_t k = 0; k < members; ++k)
        std::memcpy(static_cast<float*>(packet) + k * n + i, static_cast<const float*>(ray) + k, 4);
}
inline void load_lane(const void* packet, void* ray, std::size_t n, std::size_t i,
                      std::size_t members = kMembers) {
    for (std::size_t k = 0; k < members; ++k)
        std::memcpy(static_cast<float*>(ray) + k, static_cast<const float*>(packet) + k * n + i, 4);
}

inline RTCRayHit make_ray(Point org, Point dir, float tnear = 0, float tfar = kInfinity,
                          unsigned int mask = kInvalid) {
    RTCRayHit ray;
    std::memset(&ray, 0, sizeof ray);
    ray.ray.org_x = org[0];
    ray.ray.org_y = org[1];
    ray.ray.org_z = org[2];
    ray.ray.dir_x = dir[0];
    ray.ray.dir_y = dir[1];
    ray.ray.dir_z = dir[2];
    ray.ray.tnear = tnear;
    ray.ray.tfar = tfar;
    ray.ray.mask = mask;
    ray.hit.geomID = ray.hit.primID = ray.hit.instID[0] = kInvalid;
    return ray;
}
/// A ray down from (x, y, z).
inline RTCRayHit down(float x, float y, float z = 1) { return make_ray({x, y, z}, {0, 0, -1}); }

inline RTCRayHit trace(RTCScene scene, RTCRayHit ray, const Query& query = {}) {
    intersect1(scene, ray, query);
    return ray;
}
inline bool is_occluded(RTCScene scene, RTCRayHit ray, const Query& query = {}) {
    occluded1(scene, ray.ray, query);
    return ray.ray.tfar == -kInfinity;
}

/// A device that is released at the end, with the scenes that it has made; in between its errors
/// are taken by error().
class TestDevice {
public:
    explicit TestDevice(const char* settings = nullptr) : handle(rtcNewDevice(settings)) {}
    ~TestDevice() {
        for (RTCScene scene : scenes_) rtcReleaseScene(scene);
        rtcReleaseDevice(handle);
    }
    TestDevice(const TestDevice&) = delete;

    RTCError error() const { return rtcGetDeviceError(handle); }

    /// The caller attaches the geometry and releases it. Vertices and indices are copied.
    RTCGeometry triangles(const std::vector<Point>& vertices,
                          const std::vector<std::array<unsigned int, 3>>& indices) const {
        return mesh(3, vertices, indices.data()->data(), indices.size());
    }
    RTCGeometry quads(const std::vector<Point>& vertices,
                      const std::vector<std::array<unsigned int, 4>>& indices) const {
        return mesh(4, vertices, indices.data()->data(), indices.size());
    }
    /// Triangles or quads.
    RTCGeometry mesh(std::size_t corners, const std::vector<Point>& vertices,
                     const unsigned int* indices, std::size_t count) const {
        const bool is_quads = corners == 4;
        RTCGeometry made =
            rtcNewGeometry(handle, is_quads ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
        void* to = rtcSetNewGeometryBuffer(made, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Point), vertices.size());
        std::memcpy(to, vertices.data(), vertices.size() * sizeof(Point));
        to = rtcSetNewGeometryBuffer(made, RTC_BUFFER_TYPE_INDEX, 0,
                                     is_quads ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3, 4 * corners,
                                     count);
        std::memcpy(to, indices, 4 * corners * count);
        return made;
    }
    /// A triangle with corners (0, 0), (1, 0), (0, 1) at this height.
    RTCGeometry triangle(float z = 0) const {
        return triangles({{0, 0, z}, {1, 0, z}, {0, 1, z}}, {{0, 1, 2}});
    }
    /// A scene of these geometries, which it releases, not committed.
    RTCScene scene(const std::vector<RTCGeometry>& geometries,
                   RTCSceneFlags flags = RTC_SCENE_FLAG_NONE) const {
        RTCScene made = scenes_.emplace_back(rtcNewScene(handle));
        rtcSetSceneFlags(made, flags);
        for (RTCGeometry geometry : geometries) {
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(made, geometry);
            rtcReleaseGeometry(geometry);
        }
        return made;
    }
    RTCScene committed(const std::vector<RTCGeometry>& geometries,
                       RTCSceneFlags flags = RTC_SCENE_FLAG_NONE) const {
        RTCScene made = scene(geometries, flags);
        rtcCommitScene(made);
        return made;
    }

    RTCDevice handle;

private:
    mutable std::vector<RTCScene> scenes_;
};

/// A scene of a triangle far below and of `child` as an instance whose transformation has this
/// layout.
inline RTCScene instance_of(const TestDevice& device, RTCScene child, RTCFormat format,
                            const std::vector<float>& floats) {
    RTCGeometry instance = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, child);
    rtcSetGeometryTransform(instance, 0, format, floats.data());
    return device.committed({device.triangle(-50), instance});
}

/// A grid of 2 n n triangles over [0, 1]^2 whose height waves.
struct Waves {
    std::vector<Point> vertices;
    std::vector<std::array<unsigned int, 3>> indices;

    explicit Waves(unsigned int n) {
        for (unsigned int y = 0; y <= n; ++y) {
            for (unsigned int x = 0; x <= n; ++x) {
                const float u = static_cast<float>(x) / static_cast<float>(n);
                const float v = static_cast<float>(y) / static_cast<float>(n);
                vertices.push_back({u, v, 0.1f * std::sin(9 * u + 7 * v)});
            }
        }
        for (unsigned int y = 0; y < n; ++y) {
            for (unsigned int x = 0; x < n; ++x) {
                const unsigned int a = y * (n + 1) + x;
                const unsigned int c = a + n + 1;
                indices.push_back({a, a + 1, c});
                indices.push_back({a + 1, c + 1, c});
            }
        }
    }
};

}  // namespace mray::embree_test
