// Objects that each thread has for itself.
#pragma once

namespace mray::embree {

/// This thread's object: the first call of get() makes it, and the thread's end drops it. Static
/// objects may call get() in their destructors, which the main thread runs after its own end: this
/// makes another object, which is not dropped. get() takes one load, since the pointer lies in the
/// static block of thread-local storage (the model initial-exec).
template <class Type>
class ThreadOwned {
public:
    static Type& get() {
        if (mine_ == nullptr) make();
        return *mine_;
    }

private:
    struct AtEnd {
        ~AtEnd() {
            delete mine_;
            mine_ = nullptr;
        }
    };
    [[gnu::noinline]] static void make() {
        mine_ = new Type;
        static thread_local AtEnd at_end;
        static_cast<void>(at_end);
    }

    [[gnu::tls_model("initial-exec")]] static inline constinit thread_local Type* mine_ = nullptr;
};

}  // namespace mray::embree
