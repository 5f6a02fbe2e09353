// Writing to a file descriptor.
#pragma once

#include <cstddef>
#include <span>

namespace mray {

/// Writes all bytes. Returns 0, or the errno of the write that failed.
int write_all(int fd, std::span<const std::byte> bytes);

}  // namespace mray
