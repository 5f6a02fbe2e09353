#include "common/message_text.h"

#include <fmt/format.h>

namespace morphray {
namespace {

constexpr std::size_t kQuoteLimit = 40;

std::string without_control(std::string_view text) {
    std::string result;
    result.reserve(text.size());
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7F) {
            result += fmt::format("\\x{:02X}", byte);
        } else {
            result += c;
        }
    }
    return result;
}

}  // namespace

std::string in_quotes(std::string_view text) {
    const bool cut = text.size() > kQuoteLimit;
    return fmt::format("'{}'{}", without_control(text.substr(0, kQuoteLimit)), cut ? "..." : "");
}

std::string shown(const std::filesystem::path& path) { return without_control(path.native()); }

}  // namespace morphray
