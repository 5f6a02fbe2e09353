// Objects behind handles, which count their references.
#pragma once

#include <atomic>
#include <utility>

namespace mray::embree {

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

/// A reference to an object, or null.
template <class Type>
class Ref {
public:
    Ref() = default;
    explicit Ref(Type* object) : object_(object) {
        if (object_ != nullptr) object_->retain();
    }
    Ref(const Ref& other) : Ref(other.object_) {}
    Ref(Ref&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
    Ref& operator=(Ref other) noexcept {
        std::swap(object_, other.object_);
        return *this;
    }
    ~Ref() {
        if (object_ != nullptr) object_->release();
    }

    Type* get() const { return object_; }
    Type& operator*() const { return *object_; }
    Type* operator->() const { return object_; }
    explicit operator bool() const { return object_ != nullptr; }
    bool operator==(const Ref&) const = default;

private:
    Type* object_ = nullptr;
};

}  // namespace mray::embree
