#include "common/text/message_text.h"

#include <fmt/format.h>

namespace mray {
namespace {

constexpr std::size_t kQuoteLimit = 80;

// Bytes above `last` and control characters as \xNN.
std::string escaped(std::string_view text, unsigned last) {
    std::string result;
    result.reserve(text.size());
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7F || byte > last) {
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
    return fmt::format("'{}'{}", escaped(text.substr(0, kQuoteLimit), 0x7F), cut ? "..." : "");
}

std::string shown(const std::filesystem::path& path) { return escaped(path.native(), 0xFF); }

}  // namespace mray
