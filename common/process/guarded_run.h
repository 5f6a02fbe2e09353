// Runs what may crash or never end without taking the program along.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

namespace morphray {

/// Zeroed memory that a guarded run and its caller both see.
class SharedMemory {
public:
    /// Throws Error(kLimit) when there is none.
    explicit SharedMemory(std::size_t bytes);
    ~SharedMemory();
    SharedMemory(const SharedMemory&) = delete;
    SharedMemory& operator=(const SharedMemory&) = delete;

    /// For types without constructors that matter; from the beginning, at most as large.
    template <class T>
    std::span<T> as(std::size_t count) const {
        return {static_cast<T*>(start_), count};
    }

private:
    void* start_;
    std::size_t bytes_;
};

enum class RunEnd { kDone, kCrashed, kNoEnd };

/// Calls `work` in a process of its own, which has no thread but the caller's: it must not need
/// others, and what it writes is seen only in shared memory. kCrashed: a signal ended it, or it
/// threw. kNoEnd: it was ended after `limit_s` seconds of a processor (1 or more), or 50
/// times as long waiting. Calls `check` while it waits, which may throw to end both. Throws
/// Error(kLimit) when there can be no more processes.
RunEnd run_guarded(
    const std::function<void()>& work, unsigned limit_s,
    const std::function<void()>& check = [] {});

}  // namespace morphray
