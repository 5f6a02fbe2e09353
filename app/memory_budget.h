// Checks before the work begins that it fits into memory, so that it fails with figures instead of
// being killed.
#pragma once

#include <cstdint>
#include <string>

namespace mray::app {

/// The memory that a command holds at once.
struct Workload {
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    /// Pixels of an image, 0 for none.
    std::uint64_t pixels = 0;
    /// Backends, each of which keeps the scene and a tree.
    std::uint64_t backends = 1;
    /// Further bytes, such as results that are kept until the end.
    std::uint64_t kept_bytes = 0;
};

/// An upper estimate in bytes; saturates instead of overflowing.
std::uint64_t estimate_bytes(const Workload& workload);

struct MemoryLimit {
    std::uint64_t available_bytes = 0;
    /// The name of the limit: "the address space limit", ...
    std::string source;
};
/// The tightest of the process's address space and data limits, its control group, and what the
/// machine has left.
MemoryLimit memory_limit();

/// The most memory that the process has held at once, in bytes; 0 where the system does not tell.
std::uint64_t peak_memory_bytes();

/// The memory that the process holds now, in bytes; 0 where the system does not tell.
std::uint64_t resident_memory_bytes();

/// Throws Error(kLimit) if the address space limit leaves less than a Vulkan driver maps when it
/// starts; drivers tend to end the process then.
void require_driver_memory();

/// Throws Error(kLimit) if the estimate is above the limit.
void require_memory(const Workload& workload);
void require_memory(std::uint64_t bytes, const MemoryLimit& limit);

}  // namespace mray::app
