// Devices, and the errors of calls.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <new>
#include <string>
#include <type_traits>
#include <utility>

#include "library/embree/object.h"
#include "library/embree/rtcore.h"
#include "morphray/device.hpp"

namespace mray::embree {

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

/// Threads may use one at the same time, but for its callback.
class Device final : public Object {
public:
    /// Of Embree's text of settings threads= counts; results depend on none of them. Null: none.
    explicit Device(const char* config);

    const morphray::Device& tracer() const { return tracer_; }

    void set_error_function(RTCErrorFunction function, void* user);

    /// Names the device in slots of errors; no other device has the number.
    std::uint64_t number() const { return number_; }
    void call_error_function(const Failure& failure) const;

private:
    std::uint64_t number_;
    morphray::Device tracer_;
    RTCErrorFunction error_function_ = nullptr;
    void* error_user_ = nullptr;
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
