// Bytes as text of 64 characters (RFC 4648).
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace mray {

/// The bytes in base 64, with padding and without line ends.
std::string base64(std::span<const std::byte> bytes);

}  // namespace mray
