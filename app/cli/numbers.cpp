#include "app/cli/numbers.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

#include "common/base/errors.h"

namespace morphray::app {
namespace {

constexpr std::uint32_t kMaxSide = 65536;

[[noreturn]] void usage(std::string_view option, std::string_view text, std::string_view wanted) {
    throw Error(ErrorKind::kBadArgument, fmt::format("{}: '{}' is not {}", option, text, wanted));
}

std::vector<std::string_view> split(std::string_view text, char separator) {
    std::vector<std::string_view> parts;
    for (;;) {
        const std::size_t end = text.find(separator);
        parts.push_back(text.substr(0, end));
        if (end == std::string_view::npos) return parts;
        text.remove_prefix(end + 1);
    }
}

bool only_digits(std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// Too many digits for 64 bits give the largest number, which every range check refuses.
std::optional<std::uint64_t> read_count(std::string_view text) {
    if (!only_digits(text)) return std::nullopt;
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc::result_out_of_range) return std::numeric_limits<std::uint64_t>::max();
    return value;
}

std::uint32_t parse_side(std::string_view option, std::string_view text, std::string_view side) {
    const std::optional<std::uint64_t> value = read_count(side);
    if (!value || *value == 0) usage(option, text, "WIDTHxHEIGHT in pixels, such as 640x480");
    if (*value > kMaxSide) {
        throw Error(ErrorKind::kLimit, fmt::format("{}: '{}' is more than {} pixels a side; choose "
                                                   "a smaller image",
                                                   option, text, kMaxSide));
    }
    return static_cast<std::uint32_t>(*value);
}

}  // namespace

std::optional<double> read_number(std::string_view text) {
    double value = 0;
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, value);
    if (end != last || text.empty()) return std::nullopt;
    if (error == std::errc()) return value;
    if (error != std::errc::result_out_of_range) return std::nullopt;
    // from_chars does not say on which side: a number that underflows has a negative exponent.
    const bool negative = text.front() == '-';
    const std::string_view digits = text.substr(negative ? 1 : 0);
    const std::size_t e = digits.find_first_of("eE");
    const bool tiny = e == std::string_view::npos ? digits.starts_with("0.") : digits[e + 1] == '-';
    const double size = tiny ? 0.0 : std::numeric_limits<double>::infinity();
    return negative ? -size : size;
}

std::uint64_t parse_count(std::string_view option, std::string_view text, std::uint64_t lower,
                          std::uint64_t upper) {
    const std::optional<std::uint64_t> value = read_count(text);
    if (!value || *value < lower || *value > upper) {
        usage(option, text, fmt::format("a whole number from {} to {}", lower, upper));
    }
    return *value;
}

double parse_finite(std::string_view option, std::string_view text, double lower) {
    const std::optional<double> value = read_number(text);
    if (!value || !std::isfinite(*value) || *value < lower) {
        usage(option, text,
              std::isfinite(lower) ? fmt::format("a finite number of at least {}", lower)
                                   : std::string("a finite number"));
    }
    return *value;
}

double parse_number(std::string_view option, std::string_view text) {
    const std::optional<double> value = read_number(text);
    if (!value) usage(option, text, "a number");
    return *value;
}

Point parse_point(std::string_view option, std::string_view text) {
    const std::vector<std::string_view> parts = split(text, ',');
    if (parts.size() != 3) usage(option, text, "a point x,y,z");
    Point point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::optional<double> value = read_number(parts[axis]);
        if (!value) usage(option, text, "a point x,y,z");
        point[axis] = *value;
    }
    return point;
}

Size parse_size(std::string_view option, std::string_view text) {
    const std::vector<std::string_view> parts = split(text, 'x');
    if (parts.size() != 2) usage(option, text, "WIDTHxHEIGHT in pixels, such as 640x480");
    return {parse_side(option, text, parts[0]), parse_side(option, text, parts[1])};
}

Pixel parse_pixel(std::string_view option, std::string_view text) {
    const std::vector<std::string_view> parts = split(text, ',');
    if (parts.size() != 2) usage(option, text, "a pixel X,Y counted from the upper left corner");
    std::uint32_t xy[2];
    for (std::size_t i = 0; i < 2; ++i) {
        const std::optional<std::uint64_t> value = read_count(parts[i]);
        if (!value || *value >= kMaxSide) {
            usage(option, text, "a pixel X,Y counted from the upper left corner");
        }
        xy[i] = static_cast<std::uint32_t>(*value);
    }
    return {xy[0], xy[1]};
}

}  // namespace morphray::app
