#include "common/text/text.h"

#include <fmt/format.h>

#include <locale.h>
#include <stdlib.h>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <type_traits>

namespace mray {
namespace {

// Bytes above `last` and control characters as \xNN.
std::string escaped(std::string_view text, unsigned last) {
    std::string result;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x20 || byte == 0x7F || byte > last)
            result += fmt::format("\\x{:02X}", byte);
        else
            result += c;
    }
    return result;
}

constexpr std::int64_t kManyDigits = 1'000'000'000'000'000'000;

template <class T>
std::optional<T> parse_real(std::string_view text) {
    // from_chars accepts no '+'. "+-1" must not become -1.
    if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
    T value = 0;
    const char* const end = text.data() + text.size();
    const auto [read_to, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc::invalid_argument || read_to != end) return std::nullopt;
    if (error == std::errc()) return value;
    // from_chars says only that a number is too large or too small.
    static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
    const std::string number(text);
    if constexpr (std::is_same_v<T, float>) return strtof_l(number.c_str(), nullptr, locale);
    return strtod_l(number.c_str(), nullptr, locale);
}

}  // namespace

std::string quote(std::string_view text) {
    constexpr std::size_t kMost = 80;
    return fmt::format("'{}'{}", escaped(text.substr(0, kMost), 0x7F),
                       text.size() > kMost ? "..." : "");
}

std::string escape(const std::filesystem::path& path) { return escaped(path.native(), 0xFF); }

std::optional<std::string> from_base64(std::string_view text) {
    if (text.size() % 4 != 0) return std::nullopt;
    for (int i = 0; i < 2 && text.ends_with('='); ++i) text.remove_suffix(1);
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        const std::size_t value = kDigits.find(c);
        if (value == std::string_view::npos) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
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

std::optional<float> parse_float(std::string_view text) { return parse_real<float>(text); }

std::optional<double> parse_double(std::string_view text) { return parse_real<double>(text); }

std::optional<double> parse_coordinate(std::string_view text) {
    const std::optional<double> number = parse_double(text);
    constexpr std::uint64_t kBitsBelowFloat = (std::uint64_t{1} << 29) - 1;
    constexpr std::uint64_t kMiddle = std::uint64_t{1} << 28;
    constexpr double kLeastNormal = std::numeric_limits<float>::min();
    if (!number || *number == 0 ||
        (std::abs(*number) >= kLeastNormal &&
         (std::bit_cast<std::uint64_t>(*number) & kBitsBelowFloat) != kMiddle))
        return number;
    const double nearest = parse_float(text).value_or(0.0f);
    // Rounding takes a middle to the even one of both floats, beyond floats to an infinity.
    constexpr double kMost = std::numeric_limits<float>::max();
    const bool is_float = std::abs(*number) <= kMost && static_cast<float>(*number) == nearest;
    return is_float ? number : std::nextafter(*number, nearest);
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
    std::int64_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [read_to, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc::invalid_argument || read_to != end) return std::nullopt;
    if (error == std::errc::result_out_of_range)
        value = text.front() == '-' ? -kManyDigits : kManyDigits;
    return std::clamp(value, -kManyDigits, kManyDigits);
}

std::optional<std::uint64_t> parse_unsigned(std::string_view text) {
    if (text.empty() || text.find_first_not_of("0123456789") != std::string_view::npos)
        return std::nullopt;
    std::uint64_t value = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (result.ec != std::errc()) return std::numeric_limits<std::uint64_t>::max();
    return value;
}

std::string hex_text(double x) {
    // fmt 10 writes 0x0p-1022.
    if (x == 0) return std::signbit(x) ? "-0x0p+0" : "0x0p+0";
    return fmt::format("{:a}", x);
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace mray
