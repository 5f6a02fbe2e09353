// Preloaded into the program: the allocation whose number is in MORPHRAY_FAILING_ALLOCATION fails.
// Those of the libraries' constructors, which end the process if memory runs out, do not count.
#include <dlfcn.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

std::atomic<bool> counts = false;

bool fails() {
    static std::atomic<long> count = 0;
    static const char* const number = std::getenv("MORPHRAY_FAILING_ALLOCATION");
    return counts && number != nullptr && count++ == std::atol(number);
}

void* no_memory() {
    errno = ENOMEM;
    return nullptr;
}

using Main = int (*)(int, char**, char**);
using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);

}  // namespace

extern "C" {

void* malloc(std::size_t size) { return fails() ? no_memory() : __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) {
    return fails() ? no_memory() : __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
    return fails() ? no_memory() : __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    return fails() ? no_memory() : __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    *out = aligned_alloc(alignment, size);
    return *out == nullptr ? ENOMEM : 0;
}

int __libc_start_main(Main main, int argc, char** argv, void (*init)(), void (*fini)(),
                      void (*end_of_loader)(), void* stack) {
    const auto start = reinterpret_cast<Start>(::dlsym(RTLD_NEXT, "__libc_start_main"));
    counts = true;
    return start(main, argc, argv, init, fini, end_of_loader, stack);
}

}  // extern "C"
