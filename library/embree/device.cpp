#include "library/embree/device.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iterator>
#include <map>
#include <new>

#include "morphray/error.hpp"

namespace mray::embree {
namespace {

constexpr std::uint64_t kNoDevice = 0;

struct Errors {
    /// The first one since the last look, by the number of its device.
    std::map<std::uint64_t, RTCError> first;
    std::string last_message;
};

Errors& errors() {
    thread_local Errors mine;
    return mine;
}

std::uint64_t number_of(const Device* device) {
    return device == nullptr ? kNoDevice : device->number();
}

std::uint64_t next_number() {
    static std::atomic<std::uint64_t> last = kNoDevice;
    return ++last;
}

RTCError code_of(morphray::ErrorCode code) {
    switch (code) {
        case morphray::ErrorCode::bad_argument:
        case morphray::ErrorCode::bad_input:
            return RTC_ERROR_INVALID_ARGUMENT;
        case morphray::ErrorCode::limit:
            return RTC_ERROR_OUT_OF_MEMORY;
        case morphray::ErrorCode::unavailable:
            return RTC_ERROR_UNSUPPORTED_CPU;
        case morphray::ErrorCode::busy:
            return RTC_ERROR_INVALID_OPERATION;
        case morphray::ErrorCode::cancelled:
            return RTC_ERROR_CANCELLED;
        default:
            return RTC_ERROR_UNKNOWN;
    }
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

}  // namespace

void fail_argument(std::string message) {
    throw Failure{RTC_ERROR_INVALID_ARGUMENT, std::move(message)};
}

void fail_operation(std::string message) {
    throw Failure{RTC_ERROR_INVALID_OPERATION, std::move(message)};
}

void fail_unsupported(const std::string& what) {
    throw Unsupported{{RTC_ERROR_INVALID_OPERATION, what + " not supported by morphray"}};
}

Device::Device(const char* config)
    : number_(next_number()), tracer_(morphray::Device::cpu(read_settings(config))) {}

void report_current(Device* device, const char* call) noexcept {
    try {
        Failure failure = current_failure();
        failure.message.insert(0, std::string(call) + ": ");
        auto& [first, last_message] = errors();
        first.try_emplace(number_of(device), failure.code);
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
        const auto taken = errors().first.extract(number_of(reinterpret_cast<Device*>(device)));
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
    return guarded(__func__, nullptr, [] { return errors().last_message.c_str(); });
}
#endif
