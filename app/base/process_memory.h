// What the process has of memory, for reports.
#pragma once

#include <cstdint>

namespace mray::app {

/// The most memory that the process has held at once, in bytes; 0 where the system does not tell.
std::uint64_t peak_memory_bytes();

}  // namespace mray::app
