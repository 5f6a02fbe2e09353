#include "common/text/text_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace mray {

std::size_t utf8_length(std::string_view text) {
    if (text.empty()) return 0;
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned first = byte(0);
    if (first < 0x80) return 1;
    const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
    // 0x80 to 0xC1 continue a character or begin an overlong one.
    if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
    const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; };
    if (!std::ranges::all_of(text.substr(1, length - 1), continues)) return 0;
    const unsigned second = byte(1);
    const bool is_overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
    const bool is_surrogate = first == 0xED && second >= 0xA0;
    const bool is_too_large = first == 0xF4 && second >= 0x90;
    return is_overlong || is_surrogate || is_too_large ? 0 : length;
}

std::string utf8_text(std::string_view text) {
    std::string result;
    while (!text.empty()) {
        const std::size_t length = utf8_length(text);
        if (length == 0) {
            result += fmt::format("\\x{:02X}", static_cast<unsigned char>(text.front()));
        } else {
            result += text.substr(0, length);
        }
        text.remove_prefix(std::max<std::size_t>(1, length));
    }
    return result;
}

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

std::string quote(std::string_view text) {
    const bool cut = text.size() > kQuoteLimit;
    return fmt::format("'{}'{}", escaped(text.substr(0, kQuoteLimit), 0x7F), cut ? "..." : "");
}

std::string escape(const std::filesystem::path& path) { return escaped(path.native(), 0xFF); }

namespace {

// No name is as long; it bounds the work.
constexpr std::size_t kLongest = 64;

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before_last.swap(last);
        last.swap(row);
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const bool same = a[i - 1] == b[j - 1];
            row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0u : 1u)});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
                row[j] = std::min(row[j], before_last[j - 2] + 1);
            }
        }
    }
    return row[b.size()];
}

std::string nearest_name(std::string_view text, std::span<const std::string> names) {
    text = text.substr(0, kLongest);
    const auto nearest = std::min_element(
        names.begin(), names.end(), [text](const std::string& a, const std::string& b) {
            return edit_distance(text, a) < edit_distance(text, b);
        });
    return nearest == names.end() ? std::string() : *nearest;
}

std::string similar_name(std::string_view text, std::span<const std::string> names) {
    if (text.size() > kLongest || names.empty()) return {};
    const std::string nearest = nearest_name(text, names);
    const std::size_t most = std::max<std::size_t>(1, text.size() / 2);
    return edit_distance(text, nearest) <= most ? nearest : std::string();
}

std::string suggestion(std::string_view text, std::span<const std::string> names) {
    const std::string similar = similar_name(text, names);
    return similar.empty() ? similar : "; did you mean " + similar + "?";
}

}  // namespace mray
