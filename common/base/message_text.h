// Text from outside made fit for a message of one line.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace morphray {

/// 'text' in quotes, what is not printable ASCII as \xNN, cut to 80 bytes.
std::string in_quotes(std::string_view text);

/// A path as it is, except that control characters become \xNN.
std::string shown(const std::filesystem::path& path);

}  // namespace morphray
