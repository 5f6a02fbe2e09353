// The functions of Embree that this library does not have: each reports an error that names it.
#include "library/embree/geometry.h"
#include "library/embree/scene.h"

/// Exported by Embree, and in none of its headers.
RTC_API void rtcMakeStaticBVH(RTCBVH bvh);

namespace mray::embree {
namespace {

void refuse(const char* call, Device* device, const char* what) {
    guarded(call, device, [&] { fail_unsupported(what); });
}

/// Refuses a call about what no supported geometry has. A geometry that has it was refused when it
/// was made.
void refuse(const char* call, RTCGeometry geometry, const char* what) {
    with<Geometry>(call, geometry, [&](const Geometry& g) {
        if (g.unsupported() == nullptr) fail_unsupported(what);
    });
}

constexpr Device* kNoDevice = nullptr;
constexpr const char* kBuilder = "its own builder is";
constexpr const char* kInterpolation = "interpolation is";
constexpr const char* kSubdivision = "subdivision surfaces are";
constexpr const char* kUser = "user geometries are";

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

/// Defines a function of these parameters that refuses its call.
#define MORPHRAY_REFUSED(call, object, what, ...) \
    void call(__VA_ARGS__) { refuse(#call, object, what); }

MORPHRAY_REFUSED(rtcInterpolate, asked->geometry, kInterpolation,
                 const RTCInterpolateArguments* asked)
MORPHRAY_REFUSED(rtcInterpolateN, asked->geometry, kInterpolation,
                 const RTCInterpolateNArguments* asked)
MORPHRAY_REFUSED(rtcRetainBVH, kNoDevice, kBuilder, RTCBVH)
MORPHRAY_REFUSED(rtcReleaseBVH, kNoDevice, kBuilder, RTCBVH)
MORPHRAY_REFUSED(rtcMakeStaticBVH, kNoDevice, kBuilder, RTCBVH)

RTCBVH rtcNewBVH(RTCDevice device) {
    with<Device>(__func__, device, [](Device&) { fail_unsupported(kBuilder); });
    return nullptr;
}
void* rtcBuildBVH(const RTCBuildArguments*) {
    refuse(__func__, kNoDevice, kBuilder);
    return nullptr;
}
void* rtcThreadLocalAlloc(RTCThreadLocalAllocator, size_t, size_t) {
    refuse(__func__, kNoDevice, kBuilder);
    return nullptr;
}
void rtcCollide(RTCScene scene, RTCScene, RTCCollideFunc, void*) {
    with<SceneObject>(__func__, scene,
                      [](SceneObject&) { fail_unsupported("collision detection is"); });
}

/// Defines a function of a geometry and these parameters that refuses its call.
#define MORPHRAY_REFUSED_FOR(call, what, ...) \
    MORPHRAY_REFUSED(call, geometry, what, RTCGeometry geometry, __VA_ARGS__)
/// Defines one that returns an ID.
#define MORPHRAY_REFUSED_ID(call, ...)                     \
    unsigned int call(RTCGeometry geometry, __VA_ARGS__) { \
        refuse(#call, geometry, kSubdivision);             \
        return kInvalid;                                   \
    }

MORPHRAY_REFUSED_FOR(rtcSetGeometryMaxRadiusScale, "curves and points are", float)
MORPHRAY_REFUSED_FOR(rtcSetGeometryTessellationRate, "curves are", float)
MORPHRAY_REFUSED_FOR(rtcSetGeometryTransformQuaternion, "quaternions are", unsigned int,
                     const RTCQuaternionDecomposition*)
MORPHRAY_REFUSED_FOR(rtcSetGeometryUserPrimitiveCount, kUser, unsigned int)
MORPHRAY_REFUSED_FOR(rtcSetGeometryBoundsFunction, kUser, RTCBoundsFunction, void*)
MORPHRAY_REFUSED_FOR(rtcSetGeometryIntersectFunction, kUser, RTCIntersectFunctionN)
MORPHRAY_REFUSED_FOR(rtcSetGeometryOccludedFunction, kUser, RTCOccludedFunctionN)
MORPHRAY_REFUSED_FOR(rtcSetGeometryTopologyCount, kSubdivision, unsigned int)
MORPHRAY_REFUSED_FOR(rtcSetGeometrySubdivisionMode, kSubdivision, unsigned int, RTCSubdivisionMode)
MORPHRAY_REFUSED_FOR(rtcSetGeometryVertexAttributeTopology, kSubdivision, unsigned int,
                     unsigned int)
MORPHRAY_REFUSED_FOR(rtcSetGeometryDisplacementFunction, kSubdivision, RTCDisplacementFunctionN)
MORPHRAY_REFUSED_ID(rtcGetGeometryFirstHalfEdge, unsigned int)
MORPHRAY_REFUSED_ID(rtcGetGeometryFace, unsigned int)
MORPHRAY_REFUSED_ID(rtcGetGeometryNextHalfEdge, unsigned int)
MORPHRAY_REFUSED_ID(rtcGetGeometryPreviousHalfEdge, unsigned int)
MORPHRAY_REFUSED_ID(rtcGetGeometryOppositeHalfEdge, unsigned int, unsigned int)

#if MORPHRAY_EMBREE == 3

MORPHRAY_REFUSED(rtcFilterIntersection, kNoDevice, kUser, const RTCIntersectFunctionNArguments*,
                 const RTCFilterFunctionNArguments*)
MORPHRAY_REFUSED(rtcFilterOcclusion, kNoDevice, kUser, const RTCOccludedFunctionNArguments*,
                 const RTCFilterFunctionNArguments*)

#else

MORPHRAY_REFUSED_FOR(rtcSetGeometryInstancedScenes, "instance arrays are", RTCScene*, size_t)
MORPHRAY_REFUSED(rtcInvokeIntersectFilterFromGeometry, kNoDevice, kUser,
                 const RTCIntersectFunctionNArguments*, const RTCFilterFunctionNArguments*)
MORPHRAY_REFUSED(rtcInvokeOccludedFilterFromGeometry, kNoDevice, kUser,
                 const RTCOccludedFunctionNArguments*, const RTCFilterFunctionNArguments*)

/// Defines the functions by which user geometries forward one ray.
#define MORPHRAY_FORWARD(kind)                                                                    \
    MORPHRAY_REFUSED(rtcForward##kind##1, kNoDevice, kUser, const RTC##kind##FunctionNArguments*, \
                     RTCScene, RTCRay*, unsigned int)                                             \
    MORPHRAY_REFUSED(rtcForward##kind##1Ex, kNoDevice, kUser,                                     \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay*, unsigned int,       \
                     unsigned int)
/// Defines those for packets of n rays.
#define MORPHRAY_FORWARD_PACKET(kind, n)                                                       \
    MORPHRAY_REFUSED(rtcForward##kind##n, kNoDevice, kUser, const int*,                        \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay##n*, unsigned int) \
    MORPHRAY_REFUSED(rtcForward##kind##n##Ex, kNoDevice, kUser, const int*,                    \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay##n*, unsigned int, \
                     unsigned int)

MORPHRAY_FORWARD(Intersect)
MORPHRAY_FORWARD_PACKET(Intersect, 4)
MORPHRAY_FORWARD_PACKET(Intersect, 8)
MORPHRAY_FORWARD_PACKET(Intersect, 16)
MORPHRAY_FORWARD(Occluded)
MORPHRAY_FORWARD_PACKET(Occluded, 4)
MORPHRAY_FORWARD_PACKET(Occluded, 8)
MORPHRAY_FORWARD_PACKET(Occluded, 16)

#endif
