// Runs work that may crash or never end in a process of its own.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

namespace mray {

/// Zeroed memory that a guarded run and its caller both see.
class SharedMemory {
public:
    /// Throws Error(kLimit) if there is no memory.
    explicit SharedMemory(std::size_t bytes);
    ~SharedMemory();
    SharedMemory(const SharedMemory&) = delete;
    SharedMemory& operator=(const SharedMemory&) = delete;

    /// The memory as an array of implicit-lifetime objects; must not be larger than the memory.
    template <class T>
    std::span<T> as(std::size_t count) const {
        return {static_cast<T*>(start_), count};
    }

private:
    void* start_;
    std::size_t bytes_;
};

enum class RunEnd { kDone, kCrashed, kNoEnd };

/// Calls `work` in a child process, which has only the calling thread: `work` must not need other
/// threads, and only its writes to shared memory are visible. Returns kCrashed if a signal ended
/// the child or `work` threw; kNoEnd if the child was ended after `limit_s` (at least 1) seconds of
/// processor time. Throws Error(kLimit) if no process can be started.
RunEnd run_guarded(const std::function<void()>& work, unsigned limit_s);

}  // namespace mray
