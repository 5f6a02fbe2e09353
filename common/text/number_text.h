// Numbers from text and as text, the same in every locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mray {

/// The float nearest to the decimal number that is the whole of `text`; beyond floats an infinity.
/// "nan", "inf" and "infinity" are read in any case. Returns nothing for any other text, such as
/// hexadecimal numbers, decimal commas and blanks.
std::optional<float> parse_float(std::string_view text);

std::optional<double> parse_double(std::string_view text);

/// As parse_double, but a number that the nearest double moves to the middle of two floats is left
/// on its side of it, so that rounding it to float gives parse_float.
std::optional<double> parse_coordinate(std::string_view text);

/// As parse_double, but nothing for numbers that are not finite.
std::optional<double> parse_finite_double(std::string_view text);

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
