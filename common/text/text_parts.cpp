#include "common/text/text_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace mray {

namespace {

constexpr std::size_t kQuoteLimit = 80;

/// The least number of insertions, deletions, replacements and swaps of neighbouring characters
/// that turn one text into the other.
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
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before_last[j - 2] + 1);
        }
    }
    return row[b.size()];
}

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

std::string similar_name(std::string_view text, std::span<const std::string> names) {
    // No name is as long; it bounds the work.
    constexpr std::size_t kLongestName = 64;
    if (text.size() > kLongestName) return {};
    std::string nearest;
    std::size_t least = std::max<std::size_t>(1, text.size() / 2) + 1;
    for (const std::string& name : names) {
        const std::size_t distance = edit_distance(text, name);
        if (distance < least) nearest = name;
        least = std::min(least, distance);
    }
    return nearest;
}

std::string suggestion(std::string_view text, std::span<const std::string> names) {
    const std::string similar = similar_name(text, names);
    return similar.empty() ? similar : "; did you mean " + similar + "?";
}

}  // namespace mray
