#include "common/text/number_text.h"

#include <fmt/format.h>
#include <locale.h>
#include <stdlib.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <type_traits>

namespace mray {
namespace {

constexpr std::int64_t kManyDigits = 1'000'000'000'000'000'000;

bool digit(char c) { return c >= '0' && c <= '9'; }

// from_chars accepts no '+'. "+-1" must not become -1.
std::string_view without_plus(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
    return text;
}

template <class T>
std::optional<T> parse_real(std::string_view text) {
    text = without_plus(text);
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

std::optional<double> parse_finite_double(std::string_view text) {
    const auto value = parse_double(text);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    return value;
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
    if (text.empty() || !std::all_of(text.begin(), text.end(), digit)) return std::nullopt;
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
