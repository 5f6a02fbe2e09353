// Devices, and the errors of calls.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

#include "embree/fallback.h"
#include "embree/object.h"
#include "embree/rtcore.h"
#include "morphray/device.hpp"

namespace mray::embree {

class SpareTrees;

/// Why a call does nothing. The message is one line.
struct Failure {
    RTCError code;
    std::string message;
};

/// One of what this library does not do.
struct Unsupported : Failure {};

[[noreturn]] void fail_argument(std::string message);
[[noreturn]] void fail_operation(std::string message);
/// Throws Unsupported: `what` is the subject of a sentence.
[[noreturn]] void fail_unsupported(const std::string& what);

/// The settings in the text of rtcNewDevice().
struct Settings {
    morphray::CpuOptions options = {};
    bool is_verbose = false;
};

/// Threads may use one at the same time, but for its two callbacks.
class Device final : public Object {
public:
    /// Reads Embree's text of settings: isa=, max_isa=, threads= and verbose= count, the others are
    /// known and have no meaning here. Null: none.
    explicit Device(const char* config);
    ~Device() override;

    /// Embree's own library, if the user wishes it, and its device; null: none.
    const Fallback* fallback() const { return fallback_; }
    RTCDevice twin() const { return twin_; }
    /// Whether a user geometry was made, which may send rays on into any scene. From then on the
    /// twins of all scenes are committed.
    bool has_user_geometry() const { return has_user_geometry_; }
    void note_user_geometry() { has_user_geometry_ = true; }
    const morphray::Device& tracer() const { return tracer_; }

    void set_error_function(RTCErrorFunction function, void* user);
    void set_memory_function(RTCMemoryMonitorFunction function, void* user);
    /// Tells the memory monitor of memory that a scene is about to take. Throws Failure if it
    /// refuses.
    void take_memory(std::size_t bytes);
    void give_memory(std::size_t bytes) noexcept;
    SpareTrees& spare_trees() { return *spare_trees_; }

    /// Names the device in slots of errors; no other device has the number.
    std::uint64_t number() const { return number_; }
    /// Whether the settings ask for messages.
    bool is_verbose() const { return is_verbose_; }
    void call_error_function(const Failure& failure) const;

private:
    explicit Device(const Settings& settings);
    void make_twin(const char* config);

    std::uint64_t number_;
    bool is_verbose_ = false;
    morphray::Device tracer_;
    RTCErrorFunction error_function_ = nullptr;
    void* error_user_ = nullptr;
    RTCMemoryMonitorFunction memory_function_ = nullptr;
    void* memory_user_ = nullptr;
    std::unique_ptr<SpareTrees> spare_trees_;
    const Fallback* fallback_ = nullptr;
    RTCDevice twin_ = nullptr;
    std::atomic<bool> has_user_geometry_ = false;
};

/// Notes an error in this thread's slot of the device, or that of no device, unless the slot has an
/// error; calls the device's function for errors.
void report(Device* device, const Failure& failure) noexcept;
/// Reports the exception that is being handled.
void report_current(Device* device, const char* call) noexcept;

/// Calls `work` and returns its answer; errors are reported, and the answer is an empty value.
template <class Work>
auto guarded(const char* call, Device* device, Work work) noexcept -> decltype(work()) {
    using Answer = decltype(work());
    try {
        return work();
    } catch (...) {
        report_current(device, call);
    }
    if constexpr (!std::is_void_v<Answer>) return Answer();
}

/// The object of a handle: `Type` has device(). A null handle is an error.
template <class Type, class Handle, class Work>
auto with(const char* call, Handle handle, Work work) noexcept
    -> decltype(work(std::declval<Type&>())) {
    auto* const object = reinterpret_cast<Type*>(handle);
    Device* device = nullptr;
    if constexpr (std::is_same_v<Type, Device>) {
        device = object;
    } else if (object != nullptr) {
        device = &object->device();
    }
    return guarded(call, device, [&]() -> decltype(work(std::declval<Type&>())) {
        if (object == nullptr) fail_argument("the handle is null");
        return work(*object);
    });
}

}  // namespace mray::embree
