// Embree's own library, which answers the scenes that morphray does not, if the user wishes it.
// Each device, geometry and scene has a twin there, which is told of all that the caller sets.
#pragma once

#include <string>

#include "embree/rtcore.h"

/// Exported by Embree, and in none of its headers.
RTC_API void rtcMakeStaticBVH(RTCBVH bvh);

// clang-format off
#define MORPHRAY_FALLBACK_COMMON(F) \
    F(rtcNewDevice) F(rtcReleaseDevice) F(rtcGetDeviceError) F(rtcGetDeviceProperty) \
    F(rtcSetDeviceErrorFunction) F(rtcSetDeviceMemoryMonitorFunction) \
    F(rtcNewScene) F(rtcReleaseScene) F(rtcAttachGeometryByID) F(rtcDetachGeometry) \
    F(rtcJoinCommitScene) F(rtcSetSceneProgressMonitorFunction) F(rtcSetSceneBuildQuality) \
    F(rtcSetSceneFlags) F(rtcGetSceneBounds) F(rtcGetSceneLinearBounds) F(rtcPointQuery) \
    F(rtcPointQuery4) F(rtcPointQuery8) F(rtcPointQuery16) F(rtcCollide) \
    F(rtcNewGeometry) F(rtcReleaseGeometry) F(rtcCommitGeometry) F(rtcEnableGeometry) \
    F(rtcDisableGeometry) F(rtcSetGeometryTimeStepCount) F(rtcSetGeometryTimeRange) \
    F(rtcSetGeometryVertexAttributeCount) F(rtcSetGeometryMask) F(rtcSetGeometryBuildQuality) \
    F(rtcSetGeometryMaxRadiusScale) F(rtcSetSharedGeometryBuffer) F(rtcUpdateGeometryBuffer) \
    F(rtcSetGeometryIntersectFilterFunction) F(rtcSetGeometryOccludedFilterFunction) \
    F(rtcSetGeometryUserData) F(rtcSetGeometryPointQueryFunction) F(rtcSetGeometryInstancedScene) \
    F(rtcSetGeometryTransform) F(rtcSetGeometryTransformQuaternion) F(rtcGetGeometryTransform) \
    F(rtcSetGeometryUserPrimitiveCount) F(rtcSetGeometryBoundsFunction) \
    F(rtcSetGeometryIntersectFunction) F(rtcSetGeometryOccludedFunction) \
    F(rtcSetGeometryTessellationRate) F(rtcSetGeometryTopologyCount) \
    F(rtcSetGeometrySubdivisionMode) F(rtcSetGeometryVertexAttributeTopology) \
    F(rtcSetGeometryDisplacementFunction) F(rtcGetGeometryFirstHalfEdge) F(rtcGetGeometryFace) \
    F(rtcGetGeometryNextHalfEdge) F(rtcGetGeometryPreviousHalfEdge) \
    F(rtcGetGeometryOppositeHalfEdge) F(rtcInterpolate) F(rtcInterpolateN) \
    F(rtcIntersect1) F(rtcIntersect4) F(rtcIntersect8) F(rtcIntersect16) \
    F(rtcOccluded1) F(rtcOccluded4) F(rtcOccluded8) F(rtcOccluded16) \
    F(rtcNewBVH) F(rtcBuildBVH) F(rtcThreadLocalAlloc) F(rtcRetainBVH) F(rtcReleaseBVH) \
    F(rtcMakeStaticBVH)
#if MORPHRAY_EMBREE == 3
#define MORPHRAY_FALLBACK_FUNCTIONS(F) \
    MORPHRAY_FALLBACK_COMMON(F) \
    F(rtcIntersect1M) F(rtcIntersect1Mp) F(rtcIntersectNM) F(rtcIntersectNp) \
    F(rtcOccluded1M) F(rtcOccluded1Mp) F(rtcOccludedNM) F(rtcOccludedNp) \
    F(rtcFilterIntersection) F(rtcFilterOcclusion)
#else
#define MORPHRAY_FALLBACK_FUNCTIONS(F) \
    MORPHRAY_FALLBACK_COMMON(F) \
    F(rtcSetGeometryEnableFilterFunctionFromArguments) F(rtcSetGeometryInstancedScenes) \
    F(rtcGetGeometryTransformEx) \
    F(rtcInvokeIntersectFilterFromGeometry) F(rtcInvokeOccludedFilterFromGeometry) \
    F(rtcForwardIntersect1) F(rtcForwardIntersect1Ex) F(rtcForwardIntersect4) \
    F(rtcForwardIntersect4Ex) F(rtcForwardIntersect8) F(rtcForwardIntersect8Ex) \
    F(rtcForwardIntersect16) F(rtcForwardIntersect16Ex) \
    F(rtcForwardOccluded1) F(rtcForwardOccluded1Ex) F(rtcForwardOccluded4) \
    F(rtcForwardOccluded4Ex) F(rtcForwardOccluded8) F(rtcForwardOccluded8Ex) \
    F(rtcForwardOccluded16) F(rtcForwardOccluded16Ex)
#endif
// clang-format on

namespace mray::embree {

/// The functions of the library.
struct Fallback {
    std::string path;
#define MORPHRAY_MEMBER(name) decltype(&::name) name = nullptr;
    MORPHRAY_FALLBACK_FUNCTIONS(MORPHRAY_MEMBER)
#undef MORPHRAY_MEMBER

    /// Loads the library of this path. Throws Failure if it is not that of this version of Embree.
    explicit Fallback(const char* file);
};

/// The library that MORPHRAY_EMBREE_FALLBACK names, which a process loads once; null if the
/// variable is not set. Throws Failure.
const Fallback* load_fallback();
/// The library, or null if no device of the process has one: for calls that name no device.
const Fallback* loaded_fallback();
/// Prints on stderr, once, why morphray does not answer a scene, and that the library does. If
/// `library` is null, it prints that nothing does: some programs do not show errors.
void announce_unsupported(const std::string& reason, const Fallback* library);

/// Calls a function of the library for the twin of a geometry or scene, if there is one.
template <class Twinned, class Function, class... Arguments>
void on_twin(const Twinned& object, Function Fallback::*function, Arguments... arguments) {
    if (object.twin() != nullptr)
        (object.device().fallback()->*function)(object.twin(), arguments...);
}

}  // namespace mray::embree
