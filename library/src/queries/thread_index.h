// A number for each thread.
#pragma once

#include <cstdint>

namespace morphray::detail {

/// The number of threads that can have an index of their own at the same time.
inline constexpr std::uint32_t kIndexedThreads = 64;
inline constexpr std::uint32_t kNoThreadIndex = 0xFFFFFFFFu;

/// The index of this thread; kNoThreadIndex before the first thread_index().
[[gnu::tls_model("initial-exec")]] extern constinit thread_local std::uint32_t this_thread_index;
/// Gives this thread an index, which it returns.
std::uint32_t take_thread_index();

/// An index below kIndexedThreads that no other living thread has, or kIndexedThreads if all are
/// taken. The index of a thread that has ended is given to another one.
inline std::uint32_t thread_index() {
    return this_thread_index != kNoThreadIndex ? this_thread_index : take_thread_index();
}

}  // namespace morphray::detail
