#include "library/embree/device.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <string_view>
#include <vector>

#include "library/embree/thread_owned.h"
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

Errors& errors() { return ThreadOwned<Errors>::get(); }

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

/// The best of our instruction sets on this machine that is no newer than one of Embree's names;
/// nothing for a name that says nothing.
std::optional<std::string> target_of(std::string_view isa) {
    // Embree's names in order, and the best of ours that needs no more.
    constexpr std::pair<std::string_view, std::string_view> kNames[] = {
        {"sse", "scalar"},      {"sse2", "scalar"}, {"sse3", "scalar"}, {"ssse3", "ssse3"},
        {"sse4.1", "ssse3"},    {"sse41", "ssse3"}, {"sse4.2", "sse4"}, {"sse42", "sse4"},
        {"avx", "sse4"},        {"avxi", "sse4"},   {"avx2", "avx2"},   {"avx512", "avx512"},
        {"avx512skx", "avx512"}};
    const auto named = std::find_if(std::begin(kNames), std::end(kNames),
                                    [&](const auto& name) { return name.first == isa; });
    if (named == std::end(kNames)) return std::nullopt;
    const std::vector<std::string> have = morphray::simd_targets();
    for (auto level = named; level >= std::begin(kNames); --level) {
        if (std::find(have.begin(), have.end(), level->second) != have.end())
            return std::string(level->second);
    }
    return std::nullopt;
}

Settings read_settings(const char* config) {
    Settings settings;
    morphray::CpuOptions& options = settings.options;
    std::string text = config == nullptr ? "" : config;
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    std::erase_if(text, [](unsigned char c) { return std::isspace(c) != 0; });
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string setting = text.substr(begin, end - begin);
        const std::size_t equals = setting.find('=');
        const std::string name = setting.substr(0, equals);
        const std::string value = equals == std::string::npos ? "" : setting.substr(equals + 1);
        if (name == "threads") options.threads = std::clamp(std::atoi(value.c_str()), 0, 1024);
        if (name == "isa" || name == "max_isa")
            options.simd = target_of(value).value_or(options.simd);
        if (name == "verbose") settings.is_verbose = std::atoi(value.c_str()) > 0;
        begin = end + 1;
    }
    return settings;
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

Device::Device(const char* config) : Device(read_settings(config)) {}

Device::Device(const Settings& settings)
    : number_(next_number()),
      is_verbose_(settings.is_verbose),
      tracer_(morphray::Device::cpu(settings.options)) {
    if (is_verbose_)
        std::fprintf(stderr, "morphray: in place of Embree, %s\n", tracer_.description().c_str());
}

void Device::set_error_function(RTCErrorFunction function, void* user) {
    error_function_ = function;
    error_user_ = user;
}

void Device::set_memory_function(RTCMemoryMonitorFunction function, void* user) {
    memory_function_ = function;
    memory_user_ = user;
}

void Device::take_memory(std::size_t bytes) {
    if (memory_function_ == nullptr || bytes == 0) return;
    if (!memory_function_(memory_user_, static_cast<ssize_t>(bytes), false))
        throw Failure{RTC_ERROR_OUT_OF_MEMORY, "the memory monitor refused memory"};
}

void Device::give_memory(std::size_t bytes) noexcept {
    if (memory_function_ != nullptr && bytes != 0)
        memory_function_(memory_user_, -static_cast<ssize_t>(bytes), true);
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
        if (device->is_verbose()) std::fprintf(stderr, "morphray: %s\n", failure.message.c_str());
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

void rtcSetDeviceMemoryMonitorFunction(RTCDevice device, RTCMemoryMonitorFunction function,
                                       void* user) {
    with<Device>("rtcSetDeviceMemoryMonitorFunction", device,
                 [&](Device& d) { d.set_memory_function(function, user); });
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
