// Preloaded into the program: the allocation whose number is in MORPHRAY_FAILING_ALLOCATION fails.
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

bool fails() {
    static std::atomic<long> count = 0;
    static const char* const number = std::getenv("MORPHRAY_FAILING_ALLOCATION");
    return number != nullptr && count++ == std::atol(number);
}

}  // namespace

extern "C" {

void* malloc(std::size_t size) { return fails() ? nullptr : __libc_malloc(size); }
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    return fails() ? nullptr : __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    *out = aligned_alloc(alignment, size);
    return *out == nullptr ? ENOMEM : 0;
}

}  // extern "C"
