#include "app/base/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

constexpr std::uint32_t kMaxSide = 65536;

[[noreturn]] void usage(std::string_view option, std::string_view text, std::string_view wanted) {
    throw Error(ErrorKind::kBadArgument, fmt::format("{}: '{}' is not {}", option, text, wanted));
}

std::uint32_t parse_side(std::string_view option, std::string_view text, std::string_view side) {
    const std::optional<std::uint64_t> value = parse_unsigned(side);
    if (!value || *value == 0) usage(option, text, "WIDTHxHEIGHT in pixels, such as 640x480");
    if (*value > kMaxSide) {
        throw Error(ErrorKind::kLimit, fmt::format("{}: '{}' is more than {} pixels a side; choose "
                                                   "a smaller image",
                                                   option, text, kMaxSide));
    }
    return static_cast<std::uint32_t>(*value);
}

}  // namespace

std::uint64_t parse_count(std::string_view option, std::string_view text, std::uint64_t lower,
                          std::uint64_t upper) {
    const std::optional<std::uint64_t> value = parse_unsigned(text);
    if (!value || *value < lower || *value > upper) {
        usage(option, text, fmt::format("a whole number from {} to {}", lower, upper));
    }
    return *value;
}

double parse_finite(std::string_view option, std::string_view text, double lower) {
    const std::optional<double> value = parse_double(text);
    if (!value || !std::isfinite(*value) || *value < lower) {
        usage(option, text,
              std::isfinite(lower) ? fmt::format("a finite number of at least {}", lower)
                                   : std::string("a finite number"));
    }
    return *value;
}

double parse_number(std::string_view option, std::string_view text) {
    const std::optional<double> value = parse_double(text);
    if (!value) usage(option, text, "a number");
    return *value;
}

Point parse_point(std::string_view option, std::string_view text) {
    const std::vector<std::string_view> parts = split(text, ',');
    if (parts.size() != 3) usage(option, text, "a point x,y,z");
    Point point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::optional<double> value = parse_double(parts[axis]);
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
        const std::optional<std::uint64_t> value = parse_unsigned(parts[i]);
        if (!value || *value >= kMaxSide) {
            usage(option, text, "a pixel X,Y counted from the upper left corner");
        }
        xy[i] = static_cast<std::uint32_t>(*value);
    }
    return {xy[0], xy[1]};
}

std::string update_forms() { return fmt::format("{}", fmt::join(policy_forms(), "|")); }

PolicySpec parse_update(std::string_view option, const std::string& text) {
    try {
        return parse_policy(text);
    } catch (const Error& error) {
        throw Error(error.kind(), fmt::format("{}: {}{}", option, error.what(),
                                              suggestion(text, policy_forms())));
    }
}

std::vector<PolicySpec> parse_updates(std::string_view option, const std::string& text) {
    std::vector<PolicySpec> policies;
    for (const std::string_view part : split(text, ',')) {
        policies.push_back(parse_update(option, std::string(part)));
        if (std::count(policies.begin(), policies.end(), policies.back()) > 1) {
            throw Error(ErrorKind::kBadArgument,
                        fmt::format("{}: {} is given twice", option, text_of(policies.back())));
        }
    }
    return policies;
}

void reject_choice(std::string_view option, std::string_view text,
                   std::span<const std::string> names) {
    // A GPU is a Vulkan device.
    const bool has_vulkan = std::ranges::count(names, "vulkan") > 0;
    const std::string hint =
        text == "gpu" && has_vulkan ? "; did you mean vulkan?" : suggestion(text, names);
    throw Error(ErrorKind::kBadArgument, fmt::format("{}: '{}' is not one of {}{}", option, text,
                                                     fmt::join(names, ", "), hint));
}

}  // namespace mray::app
