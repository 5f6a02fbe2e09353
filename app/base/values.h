// Values of options: numbers are read without the locale, and never silently clamped.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/camera_setup.h"
#include "common/update/policy.h"

namespace mray::app {

// Each function throws Error(kBadArgument) that names the option.

/// A whole number in [lower, upper].
std::uint64_t parse_count(std::string_view option, std::string_view text, std::uint64_t lower,
                          std::uint64_t upper);

/// A finite number of at least `lower`.
double parse_finite(std::string_view option, std::string_view text, double lower);

/// Any number, also one that is not finite; camera_setup decides whether it is usable.
double parse_number(std::string_view option, std::string_view text);

/// `x,y,z`, each as in parse_number.
Point parse_point(std::string_view option, std::string_view text);

struct Size {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};
/// `WxH`, each side at least 1. Throws Error(kLimit) for more than 65536 a side.
Size parse_size(std::string_view option, std::string_view text);

struct Pixel {
    std::uint32_t x = 0;
    std::uint32_t y = 0;
};
/// `X,Y`, each at most 65535.
Pixel parse_pixel(std::string_view option, std::string_view text);

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms();
/// As parse_policy(), with errors that name the option and suggest a policy.
PolicySpec parse_update(std::string_view option, const std::string& text);
/// Policies separated by commas, each at most once.
std::vector<PolicySpec> parse_updates(std::string_view option, const std::string& text);

/// Throws Error(kBadArgument), which lists the names and suggests a similar one.
[[noreturn]] void reject_choice(std::string_view option, std::string_view text,
                                std::span<const std::string> names);

}  // namespace mray::app
