// Devices, the objects behind handles, and the errors of calls.
#pragma once

#define RTC_EXPORT_API
#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <atomic>
#include <memory>
#include <type_traits>
#include <utility>

#include "morphray/device.hpp"

namespace mray::embree {

#if MORPHRAY_EMBREE == 3
using Context = RTCIntersectContext;
inline constexpr unsigned int kDefaultMask = 0xFFFFFFFFu;
#else
using Context = RTCRayQueryContext;
inline constexpr unsigned int kDefaultMask = 1;
#endif
inline constexpr unsigned int kInvalid = RTC_INVALID_GEOMETRY_ID;

/// Begins with one reference, that of its maker. Threads may retain and release at the same time.
class Object {
public:
    Object() = default;
    Object(const Object&) = delete;
    Object& operator=(const Object&) = delete;

    void retain() { references_.fetch_add(1, std::memory_order_relaxed); }
    void release() {
        if (references_.fetch_sub(1, std::memory_order_acq_rel) == 1) delete this;
    }

protected:
    virtual ~Object() = default;

private:
    std::atomic<int> references_ = 1;
};

/// Keeps the object while a copy of it lives.
template <class Type>
using Ref = std::shared_ptr<Type>;

/// Takes over the reference of the maker.
template <class Type>
Ref<Type> owned(Type* made) {
    return {made, [](Type* object) { object->release(); }};
}
template <class Type>
Ref<Type> share(Type& object) {
    object.retain();
    return owned(&object);
}

/// The reason why a call does nothing. The message is one line.
struct Failure {
    RTCError code;
    std::string message;
};

[[noreturn]] void fail_argument(std::string message);
[[noreturn]] void fail_operation(std::string message);
/// This library does not have what is asked for: `what` is the subject of a sentence.
[[noreturn]] void fail_unsupported(const std::string& what);

/// Threads may use one at the same time, but for its callback.
class Device final : public Object {
public:
    /// Of Embree's text of settings threads= counts; results depend on none of them. Null: none.
    explicit Device(const char* config);

    Device& device() { return *this; }
    const morphray::Device& tracer() const { return tracer_; }

    RTCErrorFunction error_function = nullptr;
    void* error_user = nullptr;

private:
    morphray::Device tracer_;
};

/// Reports the handled exception, and notes it in this thread's slot of the device if it is free.
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

/// Calls `work` with the object of a handle: `Type` has device(). A null handle is an error.
template <class Type, class Handle, class Work>
auto with(const char* call, Handle handle, Work work) noexcept
    -> decltype(work(std::declval<Type&>())) {
    auto* const object = reinterpret_cast<Type*>(handle);
    Device* const device = object == nullptr ? nullptr : &object->device();
    return guarded(call, device, [&]() -> decltype(work(std::declval<Type&>())) {
        if (object == nullptr) fail_argument("the handle is null");
        return work(*object);
    });
}

}  // namespace mray::embree

/// Defines rtcRetainName() and rtcReleaseName(), for objects of this type.
#define MORPHRAY_COUNTED(Name, Type)                                \
    void rtcRetain##Name(RTC##Name object) {                        \
        with<Type>(__func__, object, [](Type& o) { o.retain(); });  \
    }                                                               \
    void rtcRelease##Name(RTC##Name object) {                       \
        with<Type>(__func__, object, [](Type& o) { o.release(); }); \
    }
