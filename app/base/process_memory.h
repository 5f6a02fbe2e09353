// What the process and the machine have of memory, for reports and the viewer.
#pragma once

#include <cstdint>

namespace mray::app {

/// The most memory that the process has held at once, in bytes; 0 where the system does not tell.
std::uint64_t peak_memory_bytes();

/// The memory that the process holds now, in bytes; 0 where the system does not tell.
std::uint64_t resident_memory_bytes();

/// The memory of the machine that is free, in bytes; 0 where the system does not tell.
std::uint64_t free_memory_bytes();

}  // namespace mray::app
