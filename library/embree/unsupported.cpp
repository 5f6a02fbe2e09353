// The functions of Embree that this library does not have: each reports an error that names it.
#include "library/embree/device.h"
#include "library/embree/scene/scene.h"

/// Exported by Embree, and in none of its headers.
RTC_API void rtcMakeStaticBVH(RTCBVH bvh);

namespace mray::embree {
namespace {

void refuse(const char* call, RTCScene scene, const char* what) {
    auto* const object = reinterpret_cast<SceneObject*>(scene);
    guarded(call, object == nullptr ? nullptr : &object->device(), [&] { fail_unsupported(what); });
}

constexpr const char* kBuilder = "its own builder is";

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

void rtcCollide(RTCScene scene, RTCScene, RTCCollideFunc, void*) {
    refuse("rtcCollide", scene, "collision detection is");
}

RTCBVH rtcNewBVH(RTCDevice device) {
    with<Device>("rtcNewBVH", device, [](Device&) { fail_unsupported(kBuilder); });
    return nullptr;
}
void* rtcBuildBVH(const struct RTCBuildArguments*) {
    refuse("rtcBuildBVH", nullptr, kBuilder);
    return nullptr;
}
void* rtcThreadLocalAlloc(RTCThreadLocalAllocator, size_t, size_t) {
    refuse("rtcThreadLocalAlloc", nullptr, kBuilder);
    return nullptr;
}
void rtcRetainBVH(RTCBVH) { refuse("rtcRetainBVH", nullptr, kBuilder); }
void rtcReleaseBVH(RTCBVH) { refuse("rtcReleaseBVH", nullptr, kBuilder); }
void rtcMakeStaticBVH(RTCBVH) { refuse("rtcMakeStaticBVH", nullptr, kBuilder); }

#if MORPHRAY_EMBREE == 3

void rtcFilterIntersection(const struct RTCIntersectFunctionNArguments*,
                           const struct RTCFilterFunctionNArguments*) {
    refuse("rtcFilterIntersection", nullptr, "user geometries are");
}
void rtcFilterOcclusion(const struct RTCOccludedFunctionNArguments*,
                        const struct RTCFilterFunctionNArguments*) {
    refuse("rtcFilterOcclusion", nullptr, "user geometries are");
}

#else

void rtcInvokeIntersectFilterFromGeometry(const struct RTCIntersectFunctionNArguments*,
                                          const struct RTCFilterFunctionNArguments*) {
    refuse("rtcInvokeIntersectFilterFromGeometry", nullptr, "user geometries are");
}
void rtcInvokeOccludedFilterFromGeometry(const struct RTCOccludedFunctionNArguments*,
                                         const struct RTCFilterFunctionNArguments*) {
    refuse("rtcInvokeOccludedFilterFromGeometry", nullptr, "user geometries are");
}

// Rays that user geometries forward.
void rtcForwardIntersect1(const struct RTCIntersectFunctionNArguments*, RTCScene scene,
                          struct RTCRay*, unsigned int) {
    refuse("rtcForwardIntersect1", scene, "user geometries are");
}
void rtcForwardIntersect1Ex(const struct RTCIntersectFunctionNArguments*, RTCScene scene,
                            struct RTCRay*, unsigned int, unsigned int) {
    refuse("rtcForwardIntersect1Ex", scene, "user geometries are");
}
void rtcForwardIntersect4(const int*, const struct RTCIntersectFunctionNArguments*, RTCScene scene,
                          struct RTCRay4*, unsigned int) {
    refuse("rtcForwardIntersect4", scene, "user geometries are");
}
void rtcForwardIntersect4Ex(const int*, const struct RTCIntersectFunctionNArguments*,
                            RTCScene scene, struct RTCRay4*, unsigned int, unsigned int) {
    refuse("rtcForwardIntersect4Ex", scene, "user geometries are");
}
void rtcForwardIntersect8(const int*, const struct RTCIntersectFunctionNArguments*, RTCScene scene,
                          struct RTCRay8*, unsigned int) {
    refuse("rtcForwardIntersect8", scene, "user geometries are");
}
void rtcForwardIntersect8Ex(const int*, const struct RTCIntersectFunctionNArguments*,
                            RTCScene scene, struct RTCRay8*, unsigned int, unsigned int) {
    refuse("rtcForwardIntersect8Ex", scene, "user geometries are");
}
void rtcForwardIntersect16(const int*, const struct RTCIntersectFunctionNArguments*, RTCScene scene,
                           struct RTCRay16*, unsigned int) {
    refuse("rtcForwardIntersect16", scene, "user geometries are");
}
void rtcForwardIntersect16Ex(const int*, const struct RTCIntersectFunctionNArguments*,
                             RTCScene scene, struct RTCRay16*, unsigned int, unsigned int) {
    refuse("rtcForwardIntersect16Ex", scene, "user geometries are");
}
void rtcForwardOccluded1(const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                         struct RTCRay*, unsigned int) {
    refuse("rtcForwardOccluded1", scene, "user geometries are");
}
void rtcForwardOccluded1Ex(const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                           struct RTCRay*, unsigned int, unsigned int) {
    refuse("rtcForwardOccluded1Ex", scene, "user geometries are");
}
void rtcForwardOccluded4(const int*, const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                         struct RTCRay4*, unsigned int) {
    refuse("rtcForwardOccluded4", scene, "user geometries are");
}
void rtcForwardOccluded4Ex(const int*, const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                           struct RTCRay4*, unsigned int, unsigned int) {
    refuse("rtcForwardOccluded4Ex", scene, "user geometries are");
}
void rtcForwardOccluded8(const int*, const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                         struct RTCRay8*, unsigned int) {
    refuse("rtcForwardOccluded8", scene, "user geometries are");
}
void rtcForwardOccluded8Ex(const int*, const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                           struct RTCRay8*, unsigned int, unsigned int) {
    refuse("rtcForwardOccluded8Ex", scene, "user geometries are");
}
void rtcForwardOccluded16(const int*, const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                          struct RTCRay16*, unsigned int) {
    refuse("rtcForwardOccluded16", scene, "user geometries are");
}
void rtcForwardOccluded16Ex(const int*, const struct RTCOccludedFunctionNArguments*, RTCScene scene,
                            struct RTCRay16*, unsigned int, unsigned int) {
    refuse("rtcForwardOccluded16Ex", scene, "user geometries are");
}

#endif
