// Parts of a text, and texts that are quoted or in base 64.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mray {

/// The parts between separators, one more than there are separators; parts may be empty.
inline std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (;;) {
        const std::size_t end = text.find(separator);
        parts.push_back(text.substr(0, end));
        if (end == std::string_view::npos) return parts;
        text.remove_prefix(end + 1);
    }
}

inline std::string_view trimmed(std::string_view text, std::string_view blanks) {
    const std::size_t first = text.find_first_not_of(blanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// The letter of lower case of A to Z; any other byte as it is.
constexpr char lower_case(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

inline std::string lower_case(std::string text) {
    for (char& c : text) c = lower_case(c);
    return text;
}

/// The width of all output for people.
inline constexpr std::size_t kColumns = 80;

/// `text` in lines of at most `columns` characters, or one longer word, later ones indented.
std::string wrapped(const std::string& text, std::size_t indent = 0,
                    std::size_t columns = kColumns);

/// The text in quotes, cut to 80 bytes; bytes that are not printable ASCII become \xNN.
std::string quote(std::string_view text);

/// The path, with control characters as \xNN.
std::string escape(const std::filesystem::path& path);

/// The bytes of a text in base 64. Nothing for any other text: characters outside of the 64, blanks
/// and line ends among them, a length that is no multiple of 4, padding that is not at the end.
std::optional<std::string> from_base64(std::string_view text);

}  // namespace mray
