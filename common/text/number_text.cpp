#include "common/text/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace mray {
namespace {

constexpr std::int64_t kManyDigits = 1'000'000'000'000'000'000;

bool digit(char c) { return c >= '0' && c <= '9'; }

// from_chars accepts no '+'. "+-1" must not become -1.
std::string_view without_plus(std::string_view text) {
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
    return text;
}

// Whether a number outside a type's range is too large for it rather than too small. `text` is a
// decimal number that from_chars has accepted as a whole.
bool too_large(std::string_view text) {
    std::int64_t power = 0;  // of ten, of the digit before the point once it has been normalised
    bool significant = false;
    bool after_point = false;
    std::size_t i = 0;
    for (; i < text.size() && text[i] != 'e' && text[i] != 'E'; ++i) {
        if (text[i] == '.') {
            after_point = true;
        } else if (digit(text[i])) {
            if (!significant && text[i] == '0') {
                if (after_point) --power;
            } else {
                if (!after_point) ++power;
                significant = true;
            }
        }
    }
    if (i + 1 < text.size()) {
        std::string_view exponent = without_plus(text.substr(i + 1));
        power += parse_integer(exponent).value_or(0);
    }
    return power > 0;
}

template <class T>
std::optional<T> parse_real(std::string_view text) {
    text = without_plus(text);
    T value = 0;
    const char* const end = text.data() + text.size();
    const auto [read_to, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc::invalid_argument || read_to != end) return std::nullopt;
    if (error != std::errc::result_out_of_range) return value;
    const T sign = text[0] == '-' ? T(-1) : T(1);
    if (too_large(text)) return sign * std::numeric_limits<T>::infinity();
    if constexpr (std::is_same_v<T, float>) {
        // Half of the smallest denormal and above still rounds to it.
        if (const auto wide = parse_real<double>(text)) return static_cast<float>(*wide);
    }
    return sign * T(0);
}

}  // namespace

std::optional<float> parse_float(std::string_view text) { return parse_real<float>(text); }

std::optional<double> parse_double(std::string_view text) { return parse_real<double>(text); }

std::optional<double> parse_finite_double(std::string_view text) {
    const auto value = parse_double(text);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    return value;
}

std::optional<std::int64_t> parse_integer(std::string_view text) {
    const bool negative = !text.empty() && text[0] == '-';
    if (negative) text.remove_prefix(1);
    if (text.empty()) return std::nullopt;
    std::int64_t value = 0;
    for (const char c : text) {
        if (!digit(c)) return std::nullopt;
        value = value < kManyDigits / 10 ? value * 10 + (c - '0') : kManyDigits;
    }
    return negative ? -value : value;
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
