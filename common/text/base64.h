// Bytes as text of 64 characters (RFC 4648).
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mray {

/// The bytes of a text in base 64. Nothing for any other text: characters outside of the 64, blanks
/// and line ends among them, a length that is no multiple of 4, padding that is not at the end.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace mray
