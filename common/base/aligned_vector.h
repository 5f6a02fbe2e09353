// Arrays that start on a cache line and whose elements are written before they are read.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace mray {

/// Asks for huge pages (2 MiB): one fault and one entry of the TLB instead of 512.
inline void ask_for_huge_pages(void* p, std::size_t size) {
    constexpr std::uintptr_t kHugePage = std::uintptr_t{1} << 21;
    const auto begin = reinterpret_cast<std::uintptr_t>(p);
    const std::uintptr_t first = (begin + kHugePage - 1) & -kHugePage;
    const std::uintptr_t end = (begin + size) & -kHugePage;
    // Advice only, so a refusal does no harm.
    if (first < end)
        madvise(static_cast<std::byte*>(p) + (first - begin), end - first, MADV_HUGEPAGE);
}

/// Memory that starts on a cache line (64 B). resize(n) leaves trivial elements uninitialised, so
/// that threads fault their pages in together.
template <class T>
struct CacheLineAllocator {
    using value_type = T;
    static constexpr std::align_val_t kAlignment{64};

    CacheLineAllocator() = default;
    template <class U>
    CacheLineAllocator(const CacheLineAllocator<U>&) {}

    T* allocate(std::size_t n) {
        void* const p = ::operator new(n * sizeof(T), kAlignment);
        ask_for_huge_pages(p, n * sizeof(T));
        return static_cast<T*>(p);
    }
    void deallocate(T* p, std::size_t) { ::operator delete(p, kAlignment); }
    template <class U>
    void construct(U* p) {
        ::new (static_cast<void*>(p)) U;
    }
    bool operator==(const CacheLineAllocator&) const { return true; }
};

template <class T>
using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

}  // namespace mray
