#include "common/text/text_parts.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <sstream>

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

constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t kNoDigit = 64;

constexpr std::array<std::uint8_t, 256> make_values() {
    std::array<std::uint8_t, 256> values = {};
    values.fill(kNoDigit);
    for (std::uint8_t i = 0; i < 64; ++i) values[static_cast<unsigned char>(kDigits[i])] = i;
    return values;
}
constexpr std::array<std::uint8_t, 256> kValues = make_values();

}  // namespace

std::string quote(std::string_view text) {
    const bool cut = text.size() > kQuoteLimit;
    return fmt::format("'{}'{}", escaped(text.substr(0, kQuoteLimit), 0x7F), cut ? "..." : "");
}

std::string escape(const std::filesystem::path& path) { return escaped(path.native(), 0xFF); }

std::optional<std::string> from_base64(std::string_view text) {
    if (text.size() % 4 != 0) return std::nullopt;
    std::size_t padding = 0;
    while (padding < 2 && text.ends_with('=')) {
        text.remove_suffix(1);
        ++padding;
    }
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const std::uint8_t value = kValues[static_cast<unsigned char>(c)];
        if (value == kNoDigit) return std::nullopt;
        bits = bits << 6 | value;
        count += 6;
        if (count < 8) continue;
        count -= 8;
        bytes += static_cast<char>(bits >> count & 255);
    }
    return bytes;
}

std::string wrapped(const std::string& text, std::size_t indent, std::size_t columns) {
    std::string result;
    std::istringstream paragraphs(text);
    for (std::string paragraph; std::getline(paragraphs, paragraph);) {
        if (!result.empty()) result += '\n';
        std::size_t width = 0;
        std::istringstream words(paragraph);
        for (std::string word; words >> word;) {
            if (width > 0 && width + 1 + word.size() > columns) {
                result += '\n' + std::string(indent, ' ');
                width = indent;
            } else if (width > 0) {
                result += ' ';
                ++width;
            }
            result += word;
            width += word.size();
        }
    }
    return result;
}

}  // namespace mray
