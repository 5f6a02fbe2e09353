#include "library/embree/device.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <vector>

#include "morphray/error.hpp"

namespace mray::embree {
namespace {

/// An error of this thread and a device.
struct ErrorSlot {
    std::uint64_t device;
    RTCError code;
};
constexpr std::uint64_t kNoDevice = 0;

/// The errors of this thread.
struct Errors {
    std::vector<ErrorSlot> slots;
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

/// Returns the code, and empties the slot.
RTCError take_error(std::uint64_t device) {
    std::vector<ErrorSlot>& slots = errors().slots;
    const auto slot = std::find_if(slots.begin(), slots.end(),
                                   [&](const ErrorSlot& s) { return s.device == device; });
    if (slot == slots.end()) return RTC_ERROR_NONE;
    const RTCError code = slot->code;
    slots.erase(slot);
    return code;
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

morphray::CpuOptions read_settings(const char* config) {
    morphray::CpuOptions options;
    std::string text = config == nullptr ? "" : config;
    std::erase_if(text, [](unsigned char c) { return std::isspace(c) != 0; });
    const std::size_t found = ("," + text).find(",threads=");
    if (found != std::string::npos)
        options.threads = std::clamp(std::atoi(&text[found + std::strlen("threads=")]), 0, 1024);
    return options;
}

#if MORPHRAY_EMBREE == 3
constexpr ssize_t kCommonProperties[][2] = {{RTC_DEVICE_PROPERTY_RAY_STREAM_SUPPORTED, 1}};
#else
constexpr ssize_t kCommonProperties[][2] = {{RTC_DEVICE_PROPERTY_CPU_DEVICE, 1}};
#endif

constexpr ssize_t kProperties[][2] = {
    {RTC_DEVICE_PROPERTY_VERSION, RTC_VERSION},
    {RTC_DEVICE_PROPERTY_VERSION_MAJOR, RTC_VERSION_MAJOR},
    {RTC_DEVICE_PROPERTY_VERSION_MINOR, RTC_VERSION_MINOR},
    {RTC_DEVICE_PROPERTY_VERSION_PATCH, RTC_VERSION_PATCH},
    // Filters are called for one ray at a time.
    {RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED, 0},
    {RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED, 0},
    {RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED, 0},
    {RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_TRIANGLE_GEOMETRY_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_QUAD_GEOMETRY_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_TASKING_SYSTEM, 1},
    {RTC_DEVICE_PROPERTY_JOIN_COMMIT_SUPPORTED, 1},
    {RTC_DEVICE_PROPERTY_PARALLEL_COMMIT_SUPPORTED, 1},
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

void Device::set_error_function(RTCErrorFunction function, void* user) {
    error_function_ = function;
    error_user_ = user;
}

void Device::call_error_function(const Failure& failure) const {
    if (error_function_ != nullptr)
        error_function_(error_user_, failure.code, failure.message.c_str());
}

void report(Device* device, const Failure& failure) noexcept {
    try {
        const std::uint64_t number = number_of(device);
        auto& [slots, last_message] = errors();
        const bool is_taken = std::any_of(slots.begin(), slots.end(), [&](const ErrorSlot& slot) {
            return slot.device == number;
        });
        if (!is_taken) slots.push_back({number, failure.code});
        last_message = failure.message;
        if (device == nullptr) return;
        device->call_error_function(failure);
    } catch (...) {
        // There is no memory to note that there is no memory.
    }
}

void report_current(Device* device, const char* call) noexcept {
    try {
        const std::string prefix = std::string(call) + ": ";
        try {
            throw;
        } catch (const Failure& failure) {
            report(device, {failure.code, prefix + failure.message});
        } catch (const morphray::Error& error) {
            report(device, {code_of(error.code()), prefix + error.what()});
        } catch (const std::bad_alloc&) {
            report(device, {RTC_ERROR_OUT_OF_MEMORY, prefix + "out of memory"});
        } catch (const std::exception& error) {
            report(device, {RTC_ERROR_UNKNOWN, prefix + error.what()});
        } catch (...) {
            report(device, {RTC_ERROR_UNKNOWN, prefix + "a callback threw"});
        }
    } catch (...) {
    }
}

}  // namespace mray::embree

using namespace mray::embree;

RTCDevice rtcNewDevice(const char* config) {
    return guarded("rtcNewDevice", nullptr,
                   [&] { return reinterpret_cast<RTCDevice>(new Device(config)); });
}

void rtcRetainDevice(RTCDevice device) {
    with<Device>("rtcRetainDevice", device, [](Device& d) { d.retain(); });
}

void rtcReleaseDevice(RTCDevice device) {
    with<Device>("rtcReleaseDevice", device, [](Device& d) { d.release(); });
}

ssize_t rtcGetDeviceProperty(RTCDevice device, enum RTCDeviceProperty property) {
    return with<Device>("rtcGetDeviceProperty", device, [&](Device&) -> ssize_t {
        for (const auto& [name, value] : kProperties)
            if (name == property) return value;
        for (const auto& [name, value] : kCommonProperties)
            if (name == property) return value;
        return 0;
    });
}

void rtcSetDeviceProperty(RTCDevice device, const enum RTCDeviceProperty, ssize_t) {
    with<Device>("rtcSetDeviceProperty", device,
                 [](Device&) { fail_argument("no property can be set"); });
}

RTCError rtcGetDeviceError(RTCDevice device) {
    return guarded("rtcGetDeviceError", nullptr,
                   [&] { return take_error(number_of(reinterpret_cast<Device*>(device))); });
}

void rtcSetDeviceErrorFunction(RTCDevice device, RTCErrorFunction function, void* user) {
    with<Device>("rtcSetDeviceErrorFunction", device,
                 [&](Device& d) { d.set_error_function(function, user); });
}

/// The function is never called.
void rtcSetDeviceMemoryMonitorFunction(RTCDevice device, RTCMemoryMonitorFunction, void*) {
    with<Device>("rtcSetDeviceMemoryMonitorFunction", device, [](Device&) {});
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
    return guarded("rtcGetDeviceLastErrorMessage", nullptr,
                   [] { return errors().last_message.c_str(); });
}
#endif
