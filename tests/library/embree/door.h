// Scenes and rays by Embree's interface, of version 3 or 4.
#pragma once

#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace mray::door_test {

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

inline RTCSceneFlags both(RTCSceneFlags a, RTCSceneFlags b) {
    return static_cast<RTCSceneFlags>(static_cast<int>(a) | static_cast<int>(b));
}

using Point = std::array<float, 3>;

/// Whether all members have the same bits. Version 4 has bytes behind them.
inline bool are_same(const RTCRayHit& a, const RTCRayHit& b) {
    return std::memcmp(&a, &b, MORPHRAY_EMBREE == 3 ? 80 : 84) == 0;
}

/// Sixteen rays from (0.25, 0.25, 1) straight down.
inline RTCRayHit16 packet_down() {
    RTCRayHit16 packet = {};
    for (std::size_t i = 0; i < 16; ++i) {
        packet.ray.org_x[i] = packet.ray.org_y[i] = 0.25f;
        packet.ray.org_z[i] = 1;
        packet.ray.dir_z[i] = -1;
        packet.ray.tfar[i] = kInfinity;
        packet.ray.mask[i] = kInvalid;
        packet.hit.geomID[i] = kInvalid;
    }
    return packet;
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

/// A device that is released at the end; in between its errors are taken by error().
class Door {
public:
    explicit Door(const char* settings = nullptr) : device(rtcNewDevice(settings)) {}
    ~Door() { rtcReleaseDevice(device); }
    Door(const Door&) = delete;

    RTCError error() const { return rtcGetDeviceError(device); }

    /// The caller attaches the geometry and releases it. Vertices and indices are copied.
    RTCGeometry triangles(const std::vector<Point>& vertices,
                          const std::vector<std::array<unsigned int, 3>>& indices) const {
        return mesh(RTC_GEOMETRY_TYPE_TRIANGLE, RTC_FORMAT_UINT3, vertices, indices);
    }
    RTCGeometry quads(const std::vector<Point>& vertices,
                      const std::vector<std::array<unsigned int, 4>>& indices) const {
        return mesh(RTC_GEOMETRY_TYPE_QUAD, RTC_FORMAT_UINT4, vertices, indices);
    }
    /// A triangle with corners (0, 0), (1, 0), (0, 1) at this height.
    RTCGeometry triangle(float z = 0) const {
        return triangles({{0, 0, z}, {1, 0, z}, {0, 1, z}}, {{0, 1, 2}});
    }
    /// A scene of these geometries, which it releases, not committed.
    RTCScene scene(const std::vector<RTCGeometry>& geometries,
                   RTCSceneFlags flags = RTC_SCENE_FLAG_NONE) const {
        RTCScene made = rtcNewScene(device);
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

    RTCDevice device;

private:
    template <class Index>
    RTCGeometry mesh(RTCGeometryType type, RTCFormat format, const std::vector<Point>& vertices,
                     const std::vector<Index>& indices) const {
        RTCGeometry made = rtcNewGeometry(device, type);
        void* to = rtcSetNewGeometryBuffer(made, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Point), vertices.size());
        std::memcpy(to, vertices.data(), vertices.size() * sizeof(Point));
        to = rtcSetNewGeometryBuffer(made, RTC_BUFFER_TYPE_INDEX, 0, format, sizeof(Index),
                                     indices.size());
        std::memcpy(to, indices.data(), indices.size() * sizeof(Index));
        return made;
    }
};

/// A scene of a triangle far below and of `child` as an instance whose transformation has this
/// layout.
RTCScene instance_of(const Door& door, RTCScene child, RTCFormat format,
                     const std::vector<float>& floats);

/// A function of point queries that notes the primitives in a std::vector<unsigned int>.
inline bool note_prim(RTCPointQueryFunctionArguments* arguments) {
    static_cast<std::vector<unsigned int>*>(arguments->userPtr)->push_back(arguments->primID);
    return false;
}

/// A grid of 2 n n triangles over [0, 1]^2 whose height waves.
struct Waves {
    std::vector<Point> vertices;
    std::vector<std::array<unsigned int, 3>> indices;

    explicit Waves(unsigned int n, float phase = 0);
};

}  // namespace mray::door_test
