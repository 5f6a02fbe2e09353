// Objects that each thread has for itself.
#pragma once

namespace mray::embree {

template <class Type>
struct OnHeap {
    static Type* make() { return new Type; }
    static void drop(Type* object) { delete object; }
};

/// This thread's object, which its first call makes and the end of the thread drops. The program's
/// objects may call it in their destructors, which the main thread runs after that end: it then
/// makes another one, which is not dropped. One load, as the model keeps the pointer beside those
/// of the program.
template <class Type, class Memory = OnHeap<Type>>
class ThreadOwned {
public:
    static Type& get() {
        if (mine_ == nullptr) make();
        return *mine_;
    }

private:
    struct AtEnd {
        ~AtEnd() {
            Memory::drop(mine_);
            mine_ = nullptr;
        }
    };
    [[gnu::noinline]] static void make() {
        mine_ = Memory::make();
        static thread_local AtEnd at_end;
        static_cast<void>(at_end);
    }

    [[gnu::tls_model("initial-exec")]] static inline constinit thread_local Type* mine_ = nullptr;
};

}  // namespace mray::embree
