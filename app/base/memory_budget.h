// Checks before the work begins that it fits into memory, so that it fails with figures instead of
// being killed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace mray::app {

/// The memory that a command holds at once.
struct Workload {
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    /// Whether a tree is built.
    bool has_tree = true;
    /// Trees, with all that a backend keeps for each, that are held while another tree is built.
    std::uint64_t copies = 0;
    /// Pixels of a traced image, 0 for none.
    std::uint64_t pixels = 0;
    /// Vulkan devices that are opened.
    std::uint64_t devices = 0;
    /// Further bytes, such as results that are kept until the end.
    std::uint64_t kept_bytes = 0;
};

/// An estimate in bytes for the whole process; saturates instead of overflowing. Of meshes and of
/// triangles that share no vertices it is within a fifth of what is held; a tree over triangles
/// that overlap each other has fuller memory, up to five times the estimate.
std::uint64_t estimate_bytes(const Workload& workload);

struct MemoryLimit {
    std::uint64_t available_bytes = 0;
    /// The name of the limit: "the address space limit", ...
    std::string source;
};
/// Returns what is left of the tightest of --memory-limit, the process's address space and data
/// limits, its control group, and the memory of the machine.
MemoryLimit memory_limit();

/// Sets --memory-limit for the rest of the process, before any work: the most that the process is
/// to hold. What estimates miss ends by the data limit of the process (RLIMIT_DATA) at half as much
/// again, with 256 MiB for drivers and a stack for each thread: then allocations fail. threads: as
/// in BackendOptions.
void set_memory_limit(std::uint64_t bytes, int threads);

/// The most memory that the process has held at once, in bytes; 0 where the system does not tell.
std::uint64_t peak_memory_bytes();

/// The memory that the process holds now, in bytes; 0 where the system does not tell.
std::uint64_t resident_memory_bytes();

/// Throws Error(kLimit) if the address space limit leaves less than a Vulkan driver maps when it
/// starts; drivers tend to end the process then.
void require_driver_memory();

/// Throws Error(kLimit), beginning with `scene` unless it is empty, if the estimate is above
/// --memory-limit, or above what other limits leave.
void require_memory(const Workload& workload, std::string_view scene = {});
/// Throws Error(kLimit) if bytes that are to be taken are more than a limit leaves.
void require_memory(std::uint64_t bytes, const MemoryLimit& limit, std::string_view scene = {});

}  // namespace mray::app
