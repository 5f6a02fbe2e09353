// Whether the work will fit into memory, asked before it is begun: an error with numbers instead of
// a kill in the middle.
#pragma once

#include <cstdint>
#include <string>

namespace morphray::app {

/// What a command will hold at once.
struct Workload {
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    /// Pixels of an image, 0 for none.
    std::uint64_t pixels = 0;
    /// Backends, each of which keeps the scene and a tree.
    std::uint64_t backends = 1;
    /// Bytes besides, such as results that are kept until the end.
    std::uint64_t kept_bytes = 0;
};

/// An upper estimate in bytes; saturates instead of overflowing.
std::uint64_t estimate_bytes(const Workload& workload);

struct MemoryLimit {
    std::uint64_t available_bytes = 0;
    /// Which limit it is: "the address space limit", ...
    std::string source;
};
/// The tightest of the process's address space and data limits, its control group, and what the
/// machine has left.
MemoryLimit memory_limit();

/// Throws Error(kLimit) when a Vulkan driver would not find the address space that it maps at the
/// start: drivers tend to end the process then.
void require_driver_memory();

/// Throws Error(kLimit) when the estimate is above the limit.
void require_memory(const Workload& workload);
void require_memory(std::uint64_t bytes, const MemoryLimit& limit);

}  // namespace morphray::app
