// Bytes that are UTF-8, and readable text for those that are not.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mray {

/// The length of the character that the text begins with, 1 to 4 bytes; 0 if it begins with bytes
/// that are no UTF-8 (overlong forms, surrogates and characters above U+10FFFF included), or is
/// empty.
std::size_t utf8_length(std::string_view text);

/// The text with each byte that is no part of UTF-8 as \xNN. Other bytes stay as they are.
std::string utf8_text(std::string_view text);

}  // namespace mray
