#include "library/embree/device.h"

#include <cctype>
#include <cstring>
#include <exception>
#include <new>

#include "library/embree/scene.h"

namespace mray::embree {
namespace {

/// The first error since the last look; that of no device, too.
thread_local std::map<const Device*, RTCError> first_errors;
thread_local std::string last_message;

RTCError code_of(morphray::ErrorCode code) {
    using enum morphray::ErrorCode;
    if (code == bad_argument || code == bad_input) return RTC_ERROR_INVALID_ARGUMENT;
    if (code == limit) return RTC_ERROR_OUT_OF_MEMORY;
    if (code == unavailable) return RTC_ERROR_UNSUPPORTED_CPU;
    if (code == busy) return RTC_ERROR_INVALID_OPERATION;
    return code == cancelled ? RTC_ERROR_CANCELLED : RTC_ERROR_UNKNOWN;
}

Failure current_failure() {
    try {
        throw;
    } catch (const Failure& failure) {
        return failure;
    } catch (const morphray::Error& error) {
        return {code_of(error.code()), error.what()};
    } catch (const std::bad_alloc&) {
        return {RTC_ERROR_OUT_OF_MEMORY, "out of memory"};
    } catch (const std::exception& error) {
        return {RTC_ERROR_UNKNOWN, error.what()};
    } catch (...) {
        return {RTC_ERROR_UNKNOWN, "a callback threw"};
    }
}

morphray::CpuOptions read_settings(const char* config) {
    morphray::CpuOptions options;
    std::string text = config == nullptr ? "" : config;
    std::erase_if(text, [](unsigned char c) { return std::isspace(c) != 0; });
    const std::size_t found = ("," + text).find(",threads=");
    if (found != std::string::npos)
        options.threads = std::clamp(std::atoi(&text[found + std::strlen("threads=")]), 0, 1024);
    return options;
}

/// Filters are called for one ray at a time, so no packets are native.
constexpr ssize_t kProperties[][2] = {
    {RTC_DEVICE_PROPERTY_VERSION, RTC_VERSION},
    {RTC_DEVICE_PROPERTY_VERSION_MAJOR, RTC_VERSION_MAJOR},
    {RTC_DEVICE_PROPERTY_VERSION_MINOR, RTC_VERSION_MINOR},
    {RTC_DEVICE_PROPERTY_VERSION_PATCH, RTC_VERSION_PATCH},
    {RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_QUAD_GEOMETRY_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_TASKING_SYSTEM, 1},
    {RTC_DEVICE_PROPERTY_JOIN_COMMIT_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_PARALLEL_COMMIT_SUPPORTED, 1},
#if MORPHRAY_EMBREE == 3
    {RTC_DEVICE_PROPERTY_RAY_STREAM_SUPPORTED, 1},
#else
    {RTC_DEVICE_PROPERTY_CPU_DEVICE, 1},
#endif
};

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
#if MORPHRAY_EMBREE == 3
constexpr const char* kStreams = "streams of packets and of arrays are";
#endif
constexpr const char* kSubdivision = "subdivision surfaces are";
constexpr const char* kUser = "user geometries are";

}  // namespace

void fail_argument(std::string message) {
    throw Failure{RTC_ERROR_INVALID_ARGUMENT, std::move(message)};
}
void fail_operation(std::string message) {
    throw Failure{RTC_ERROR_INVALID_OPERATION, std::move(message)};
}
void fail_unsupported(const std::string& what) {
    fail_operation(what + " not supported by morphray");
}

Device::Device(const char* config) : tracer_(morphray::Device::cpu(read_settings(config))) {
    // An earlier device may have had the address.
    first_errors.erase(this);
}

void report_current(Device* device, const char* call) noexcept {
    try {
        Failure failure = current_failure();
        failure.message.insert(0, std::string(call) + ": ");
        first_errors.try_emplace(device, failure.code);
        last_message = failure.message;
        if (device == nullptr || device->error_function == nullptr) return;
        device->error_function(device->error_user, failure.code, failure.message.c_str());
    } catch (...) {
        // There is no memory to note that there is no memory.
    }
}

}  // namespace mray::embree

using namespace mray::embree;

RTCDevice rtcNewDevice(const char* config) {
    return guarded(__func__, nullptr,
                   [&] { return reinterpret_cast<RTCDevice>(new Device(config)); });
}

MORPHRAY_COUNTED(Device, Device)

ssize_t rtcGetDeviceProperty(RTCDevice device, enum RTCDeviceProperty property) {
    return with<Device>(__func__, device, [&](Device&) -> ssize_t {
        for (const auto& [name, value] : kProperties)
            if (name == property) return value;
        return 0;
    });
}
void rtcSetDeviceProperty(RTCDevice device, const enum RTCDeviceProperty, ssize_t) {
    with<Device>(__func__, device, [](Device&) { fail_argument("no property can be set"); });
}
RTCError rtcGetDeviceError(RTCDevice device) {
    return guarded(__func__, nullptr, [&] {
        const auto taken = first_errors.extract(reinterpret_cast<Device*>(device));
        return taken ? taken.mapped() : RTC_ERROR_NONE;
    });
}

void rtcSetDeviceErrorFunction(RTCDevice device, RTCErrorFunction function, void* user) {
    with<Device>(__func__, device, [&](Device& d) {
        d.error_function = function;
        d.error_user = user;
    });
}

/// The function is never called.
void rtcSetDeviceMemoryMonitorFunction(RTCDevice device, RTCMemoryMonitorFunction, void*) {
    with<Device>(__func__, device, [](Device&) {});
}

#if MORPHRAY_EMBREE == 4
const char* rtcGetErrorString(RTCError error) {
    constexpr const char* kNames[] = {"RTC_ERROR_NONE",
                                      "RTC_ERROR_UNKNOWN",
                                      "RTC_ERROR_INVALID_ARGUMENT",
                                      "RTC_ERROR_INVALID_OPERATION",
                                      "RTC_ERROR_OUT_OF_MEMORY",
                                      "RTC_ERROR_UNSUPPORTED_CPU",
                                      "RTC_ERROR_CANCELLED",
                                      "RTC_ERROR_LEVEL_ZERO_RAYTRACING_SUPPORT_MISSING"};
    const auto code = static_cast<std::size_t>(error);
    return code < std::size(kNames) ? kNames[code] : "RTC_ERROR_UNKNOWN";
}
const char* rtcGetDeviceLastErrorMessage(RTCDevice) {
    return guarded(__func__, nullptr, [] { return last_message.c_str(); });
}
#endif

// ---- Functions that this library does not have: each reports an error that names it

/// Exported by Embree, and in none of its headers.
RTC_API void rtcMakeStaticBVH(RTCBVH bvh);

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
#define MORPHRAY_REFUSED_POINTS(n)                                                                 \
    MORPHRAY_REFUSED_AS(bool, rtcPointQuery##n, scene, "packets of point queries are", const int*, \
                        RTCScene scene, RTCPointQuery##n*, RTCPointQueryContext*,                  \
                        RTCPointQueryFunction, void**)

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

#define MORPHRAY_FORWARD_PACKET(kind, n)                                                       \
    MORPHRAY_REFUSED(rtcForward##kind##n, kNoHandle, kUser, const int*,                        \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay##n*, unsigned int) \
    MORPHRAY_REFUSED(rtcForward##kind##n##Ex, kNoHandle, kUser, const int*,                    \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay##n*, unsigned int, \
                     unsigned int)
#define MORPHRAY_FORWARD(kind)                                                                    \
    MORPHRAY_REFUSED(rtcForward##kind##1, kNoHandle, kUser, const RTC##kind##FunctionNArguments*, \
                     RTCScene, RTCRay*, unsigned int)                                             \
    MORPHRAY_REFUSED(rtcForward##kind##1Ex, kNoHandle, kUser,                                     \
                     const RTC##kind##FunctionNArguments*, RTCScene, RTCRay*, unsigned int,       \
                     unsigned int)                                                                \
    MORPHRAY_FORWARD_PACKET(kind, 4)                                                              \
    MORPHRAY_FORWARD_PACKET(kind, 8)                                                              \
    MORPHRAY_FORWARD_PACKET(kind, 16)

MORPHRAY_FORWARD(Intersect)
MORPHRAY_FORWARD(Occluded)
#endif
