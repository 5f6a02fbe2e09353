// Makes text from outside fit for a message of one line.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mray {

/// The text in quotes, cut to 80 bytes; bytes that are not printable ASCII become \xNN.
std::string in_quotes(std::string_view text);

/// The path, with control characters as \xNN.
std::string shown(const std::filesystem::path& path);

}  // namespace mray
