// Text: its parts, quotes and lines, base 64; and numbers, the same in every locale.
#pragma once

#include <cstddef>
#include <cstdint>
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

/// A to Z in lower case; other bytes stay as they are.
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

/// The bytes of a text in base 64. Nothing for any other text, such as one with blanks or line ends
/// or whose length is no multiple of 4.
std::optional<std::string> from_base64(std::string_view text);

// ---- Numbers

/// The float nearest to the decimal number that is the whole of `text`; beyond floats an infinity.
/// "nan", "inf" and "infinity" are read in any case. Returns nothing for any other text, such as
/// hexadecimal numbers, decimal commas and blanks.
std::optional<float> parse_float(std::string_view text);

std::optional<double> parse_double(std::string_view text);

/// As parse_double, but a number that the nearest double moves to the middle of two floats is left
/// on its side of it, so that rounding it to float gives parse_float.
std::optional<double> parse_coordinate(std::string_view text);

/// A decimal integer that is the whole of `text`, '-' and digits. Beyond 18 digits the result is
/// -10^18 or 10^18, which stands for "out of any range".
std::optional<std::int64_t> parse_integer(std::string_view text);

/// A number in decimal digits alone that is the whole of `text`; 2^64 - 1 for larger ones.
std::optional<std::uint64_t> parse_unsigned(std::string_view text);

/// All bits of a number as text, as printf's %a writes them: "0x1.8p+1". NaNs are "nan" or "-nan".
std::string hex_text(double x);

/// A hash as reports show it: 16 hexadecimal digits.
std::string hash_text(std::uint64_t hash);

}  // namespace mray
