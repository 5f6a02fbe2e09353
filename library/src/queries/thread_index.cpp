#include "library/src/queries/thread_index.h"

#include <bit>
#include <mutex>

namespace morphray::detail {
namespace {

static_assert(kIndexedThreads == 64, "a bit of free_indices each");
constinit std::mutex mutex;
/// Guarded by mutex, which also orders what two threads do under one index.
constinit std::uint64_t free_indices = ~std::uint64_t{0};

/// Gives the index back when the thread ends. Rays that later destructors of the thread ask for
/// count under the index that threads share.
struct IndexOwner {
    ~IndexOwner() {
        const std::scoped_lock lock(mutex);
        free_indices |= std::uint64_t{1} << this_thread_index;
        this_thread_index = kIndexedThreads;
    }
};

}  // namespace

[[gnu::tls_model("initial-exec")]] constinit thread_local std::uint32_t this_thread_index =
    kNoThreadIndex;

std::uint32_t take_thread_index() {
    {
        const std::scoped_lock lock(mutex);
        if (free_indices == 0) return kIndexedThreads;
        this_thread_index = static_cast<std::uint32_t>(std::countr_zero(free_indices));
        free_indices &= free_indices - 1;
    }
    thread_local const IndexOwner owner;
    return this_thread_index;
}

}  // namespace morphray::detail
