// The functions of Embree that this library does not have: each is handed to the fallback library,
// or reports an error that names it.
#include "embree/device.h"
#include "embree/geometry.h"
#include "embree/scene/scene.h"

namespace mray::embree {
namespace {

void refuse(const char* call, RTCScene scene, const char* what) {
    auto* const object = reinterpret_cast<SceneObject*>(scene);
    guarded(call, object == nullptr ? nullptr : &object->device(), [&] { fail_unsupported(what); });
}

/// The twin that takes rays which a user geometry sends on.
[[maybe_unused]] Forward forward_rays(RTCScene handle) {
    const auto* const scene = reinterpret_cast<const SceneObject*>(handle);
    if (scene == nullptr || scene->committed_twin() == nullptr) return {};
    return {scene->device().fallback(), scene->committed_twin()};
}

constexpr const char* kBuilder = "its own builder is";

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

void rtcCollide(RTCScene scene, RTCScene other, RTCCollideFunc function, void* user) {
    const Forward to = forward(scene);
    const Forward to_other = forward(other);
    if (to && to_other) return to->rtcCollide(to.scene, to_other.scene, function, user);
    refuse("rtcCollide", scene, "collision detection is");
}

RTCBVH rtcNewBVH(RTCDevice device) {
    return with<Device>("rtcNewBVH", device, [](Device& d) {
        if (d.twin() == nullptr) fail_unsupported(kBuilder);
        return d.fallback()->rtcNewBVH(d.twin());
    });
}
void* rtcBuildBVH(const struct RTCBuildArguments* arguments) {
    if (const Fallback* const library = loaded_fallback()) return library->rtcBuildBVH(arguments);
    refuse("rtcBuildBVH", nullptr, kBuilder);
    return nullptr;
}
void* rtcThreadLocalAlloc(RTCThreadLocalAllocator allocator, size_t bytes, size_t alignment) {
    if (const Fallback* const library = loaded_fallback())
        return library->rtcThreadLocalAlloc(allocator, bytes, alignment);
    refuse("rtcThreadLocalAlloc", nullptr, kBuilder);
    return nullptr;
}
void rtcRetainBVH(RTCBVH bvh) {
    if (const Fallback* const library = loaded_fallback()) return library->rtcRetainBVH(bvh);
    refuse("rtcRetainBVH", nullptr, kBuilder);
}
void rtcReleaseBVH(RTCBVH bvh) {
    if (const Fallback* const library = loaded_fallback()) return library->rtcReleaseBVH(bvh);
    refuse("rtcReleaseBVH", nullptr, kBuilder);
}
void rtcMakeStaticBVH(RTCBVH bvh) {
    if (const Fallback* const library = loaded_fallback()) return library->rtcMakeStaticBVH(bvh);
    refuse("rtcMakeStaticBVH", nullptr, kBuilder);
}

#if MORPHRAY_EMBREE == 3

void rtcFilterIntersection(const struct RTCIntersectFunctionNArguments* arguments,
                           const struct RTCFilterFunctionNArguments* filter) {
    if (const Fallback* const library = loaded_fallback())
        return library->rtcFilterIntersection(arguments, filter);
    refuse("rtcFilterIntersection", nullptr, "user geometries are");
}
void rtcFilterOcclusion(const struct RTCOccludedFunctionNArguments* arguments,
                        const struct RTCFilterFunctionNArguments* filter) {
    if (const Fallback* const library = loaded_fallback())
        return library->rtcFilterOcclusion(arguments, filter);
    refuse("rtcFilterOcclusion", nullptr, "user geometries are");
}

#else

void rtcInvokeIntersectFilterFromGeometry(const struct RTCIntersectFunctionNArguments* arguments,
                                          const struct RTCFilterFunctionNArguments* filter) {
    if (const Fallback* const library = loaded_fallback())
        return library->rtcInvokeIntersectFilterFromGeometry(arguments, filter);
    refuse("rtcInvokeIntersectFilterFromGeometry", nullptr, "user geometries are");
}
void rtcInvokeOccludedFilterFromGeometry(const struct RTCOccludedFunctionNArguments* arguments,
                                         const struct RTCFilterFunctionNArguments* filter) {
    if (const Fallback* const library = loaded_fallback())
        return library->rtcInvokeOccludedFilterFromGeometry(arguments, filter);
    refuse("rtcInvokeOccludedFilterFromGeometry", nullptr, "user geometries are");
}

// Rays that user geometries forward.
void rtcForwardIntersect1(const struct RTCIntersectFunctionNArguments* arguments, RTCScene scene,
                          struct RTCRay* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect1(arguments, to.scene, ray, instance);
    refuse("rtcForwardIntersect1", scene, "user geometries are");
}
void rtcForwardIntersect1Ex(const struct RTCIntersectFunctionNArguments* arguments, RTCScene scene,
                            struct RTCRay* ray, unsigned int instance, unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect1Ex(arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardIntersect1Ex", scene, "user geometries are");
}
void rtcForwardIntersect4(const int* valid, const struct RTCIntersectFunctionNArguments* arguments,
                          RTCScene scene, struct RTCRay4* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect4(valid, arguments, to.scene, ray, instance);
    refuse("rtcForwardIntersect4", scene, "user geometries are");
}
void rtcForwardIntersect4Ex(const int* valid,
                            const struct RTCIntersectFunctionNArguments* arguments, RTCScene scene,
                            struct RTCRay4* ray, unsigned int instance, unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect4Ex(valid, arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardIntersect4Ex", scene, "user geometries are");
}
void rtcForwardIntersect8(const int* valid, const struct RTCIntersectFunctionNArguments* arguments,
                          RTCScene scene, struct RTCRay8* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect8(valid, arguments, to.scene, ray, instance);
    refuse("rtcForwardIntersect8", scene, "user geometries are");
}
void rtcForwardIntersect8Ex(const int* valid,
                            const struct RTCIntersectFunctionNArguments* arguments, RTCScene scene,
                            struct RTCRay8* ray, unsigned int instance, unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect8Ex(valid, arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardIntersect8Ex", scene, "user geometries are");
}
void rtcForwardIntersect16(const int* valid, const struct RTCIntersectFunctionNArguments* arguments,
                           RTCScene scene, struct RTCRay16* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect16(valid, arguments, to.scene, ray, instance);
    refuse("rtcForwardIntersect16", scene, "user geometries are");
}
void rtcForwardIntersect16Ex(const int* valid,
                             const struct RTCIntersectFunctionNArguments* arguments, RTCScene scene,
                             struct RTCRay16* ray, unsigned int instance, unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardIntersect16Ex(valid, arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardIntersect16Ex", scene, "user geometries are");
}
void rtcForwardOccluded1(const struct RTCOccludedFunctionNArguments* arguments, RTCScene scene,
                         struct RTCRay* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded1(arguments, to.scene, ray, instance);
    refuse("rtcForwardOccluded1", scene, "user geometries are");
}
void rtcForwardOccluded1Ex(const struct RTCOccludedFunctionNArguments* arguments, RTCScene scene,
                           struct RTCRay* ray, unsigned int instance, unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded1Ex(arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardOccluded1Ex", scene, "user geometries are");
}
void rtcForwardOccluded4(const int* valid, const struct RTCOccludedFunctionNArguments* arguments,
                         RTCScene scene, struct RTCRay4* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded4(valid, arguments, to.scene, ray, instance);
    refuse("rtcForwardOccluded4", scene, "user geometries are");
}
void rtcForwardOccluded4Ex(const int* valid, const struct RTCOccludedFunctionNArguments* arguments,
                           RTCScene scene, struct RTCRay4* ray, unsigned int instance,
                           unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded4Ex(valid, arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardOccluded4Ex", scene, "user geometries are");
}
void rtcForwardOccluded8(const int* valid, const struct RTCOccludedFunctionNArguments* arguments,
                         RTCScene scene, struct RTCRay8* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded8(valid, arguments, to.scene, ray, instance);
    refuse("rtcForwardOccluded8", scene, "user geometries are");
}
void rtcForwardOccluded8Ex(const int* valid, const struct RTCOccludedFunctionNArguments* arguments,
                           RTCScene scene, struct RTCRay8* ray, unsigned int instance,
                           unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded8Ex(valid, arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardOccluded8Ex", scene, "user geometries are");
}
void rtcForwardOccluded16(const int* valid, const struct RTCOccludedFunctionNArguments* arguments,
                          RTCScene scene, struct RTCRay16* ray, unsigned int instance) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded16(valid, arguments, to.scene, ray, instance);
    refuse("rtcForwardOccluded16", scene, "user geometries are");
}
void rtcForwardOccluded16Ex(const int* valid, const struct RTCOccludedFunctionNArguments* arguments,
                            RTCScene scene, struct RTCRay16* ray, unsigned int instance,
                            unsigned int prim) {
    if (const Forward to = forward_rays(scene))
        return to->rtcForwardOccluded16Ex(valid, arguments, to.scene, ray, instance, prim);
    refuse("rtcForwardOccluded16Ex", scene, "user geometries are");
}

#endif
