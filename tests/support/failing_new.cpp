#include "tests/support/failing_new.h"

#include <cstddef>
#include <cstdlib>
#include <new>

namespace mray::test {

thread_local long allocations_left = -1;

}  // namespace mray::test

void* operator new(std::size_t size) {
    long& left = mray::test::allocations_left;
    if (left == 0) {
        left = -1;
        throw std::bad_alloc();
    }
    if (left > 0) --left;
    void* const memory = std::malloc(size > 0 ? size : 1);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
