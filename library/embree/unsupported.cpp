// The functions of Embree that this library does not have: each reports an error that names it.
#include "library/embree/geometry.h"
#include "library/embree/scene.h"

/// Exported by Embree, and in none of its headers.
RTC_API void rtcMakeStaticBVH(RTCBVH bvh);

namespace mray::embree {
namespace {

void refuse(const char* call, RTCDevice device, const char* what) {
    guarded(call, reinterpret_cast<Device*>(device), [&] { fail_unsupported(what); });
}

void refuse(const char* call, RTCScene scene, const char* what) {
    with<SceneObject>(call, scene, [&](const SceneObject&) { fail_unsupported(what); });
}

/// A geometry that has what the call is about was refused when it was made.
void refuse(const char* call, RTCGeometry geometry, const char* what) {
    with<Geometry>(call, geometry, [&](const Geometry& g) {
        if (g.unsupported() == nullptr) fail_unsupported(what);
    });
}

constexpr RTCDevice kNoHandle = nullptr;
constexpr const char* kBuilder = "its own builder is";
constexpr const char* kInterpolation = "interpolation is";
constexpr const char* kPointPackets = "packets of point queries are";
#if MORPHRAY_EMBREE == 3
constexpr const char* kStreams = "streams of packets and of arrays are";
#endif
constexpr const char* kSubdivision = "subdivision surfaces are";
constexpr const char* kUser = "user geometries are";

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

/// Defines a function of these parameters that refuses its call and returns an empty value.
#define MORPHRAY_REFUSED_AS(Result, call, object, what, ...) \
    Result call(__VA_ARGS__) {                               \
        refuse(#call, object, what);                         \
        return static_cast<Result>(0);                       \
    }
#define MORPHRAY_REFUSED(...) MORPHRAY_REFUSED_AS(void, __VA_ARGS__)
#define MORPHRAY_REFUSED_FOR(call, what, ...) \
    MORPHRAY_REFUSED(call, geometry, what, RTCGeometry geometry, __VA_ARGS__)
#define MORPHRAY_REFUSED_ID(call, ...)                     \
    unsigned int call(RTCGeometry geometry, __VA_ARGS__) { \
        refuse(#call, geometry, kSubdivision);             \
        return kInvalid;                                   \
    }
#define MORPHRAY_REFUSED_POINTS(n)                                                                \
    MORPHRAY_REFUSED_AS(bool, rtcPointQuery##n, scene, kPointPackets, const int*, RTCScene scene, \
                        RTCPointQuery##n*, RTCPointQueryContext*, RTCPointQueryFunction, void**)

MORPHRAY_REFUSED(rtcInterpolate, asked->geometry, kInterpolation,
                 const RTCInterpolateArguments* asked)
MORPHRAY_REFUSED(rtcInterpolateN, asked->geometry, kInterpolation,
                 const RTCInterpolateNArguments* asked)
MORPHRAY_REFUSED_POINTS(4)
MORPHRAY_REFUSED_POINTS(8)
MORPHRAY_REFUSED_POINTS(16)
MORPHRAY_REFUSED(rtcCollide, scene, "collision detection is", RTCScene scene, RTCScene,
                 RTCCollideFunc, void*)
MORPHRAY_REFUSED(rtcRetainBVH, kNoHandle, kBuilder, RTCBVH)
MORPHRAY_REFUSED(rtcReleaseBVH, kNoHandle, kBuilder, RTCBVH)
MORPHRAY_REFUSED(rtcMakeStaticBVH, kNoHandle, kBuilder, RTCBVH)
MORPHRAY_REFUSED_AS(RTCBVH, rtcNewBVH, device, kBuilder, RTCDevice device)
MORPHRAY_REFUSED_AS(void*, rtcBuildBVH, kNoHandle, kBuilder, const RTCBuildArguments*)
MORPHRAY_REFUSED_AS(void*, rtcThreadLocalAlloc, kNoHandle, kBuilder, RTCThreadLocalAllocator,
                    size_t, size_t)
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

MORPHRAY_REFUSED(rtcIntersectNM, scene, kStreams, RTCScene scene, RTCIntersectContext*, RTCRayHitN*,
                 unsigned int, unsigned int, size_t)
MORPHRAY_REFUSED(rtcOccludedNM, scene, kStreams, RTCScene scene, RTCIntersectContext*, RTCRayN*,
                 unsigned int, unsigned int, size_t)
MORPHRAY_REFUSED(rtcIntersectNp, scene, kStreams, RTCScene scene, RTCIntersectContext*,
                 const RTCRayHitNp*, unsigned int)
MORPHRAY_REFUSED(rtcOccludedNp, scene, kStreams, RTCScene scene, RTCIntersectContext*,
                 const RTCRayNp*, unsigned int)
MORPHRAY_REFUSED(rtcFilterIntersection, kNoHandle, kUser, const RTCIntersectFunctionNArguments*,
                 const RTCFilterFunctionNArguments*)
MORPHRAY_REFUSED(rtcFilterOcclusion, kNoHandle, kUser, const RTCOccludedFunctionNArguments*,
                 const RTCFilterFunctionNArguments*)

#else

MORPHRAY_REFUSED_FOR(rtcSetGeometryInstancedScenes, "instance arrays are", RTCScene*, size_t)
MORPHRAY_REFUSED(rtcInvokeIntersectFilterFromGeometry, kNoHandle, kUser,
                 const RTCIntersectFunctionNArguments*, const RTCFilterFunctionNArguments*)
MORPHRAY_REFUSED(rtcInvokeOccludedFilterFromGeometry, kNoHandle, kUser,
                 const RTCOccludedFunctionNArguments*, const RTCFilterFunctionNArguments*)

#define MORPHRAY_FORWARD(kind)                                                                    \
    MORPHRAY_REFUSED(rtcForward##kind##1, kNoHandle, kUser, const RTC##kind##FunctionNArguments*, \
                     RTCScene, RTCRay*, unsigned int)                                             \
    MORPHRAY_REFUSED(rtcForward##kind##1Ex, kNoHandle, kUser,                                     \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay*, unsigned int,       \
                     unsigned int)
#define MORPHRAY_FORWARD_PACKET(kind, n)                                                       \
    MORPHRAY_REFUSED(rtcForward##kind##n, kNoHandle, kUser, const int*,                        \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay##n*, unsigned int) \
    MORPHRAY_REFUSED(rtcForward##kind##n##Ex, kNoHandle, kUser, const int*,                    \
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
