// Numbers from text, the same in every locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace morphray {

/// The float nearest to a decimal number that is the whole of `text`: an optional sign, digits with
/// or without a point, an optional exponent. What is too small becomes 0 or a denormal, what is too
/// large an infinity; "nan", "inf" and "infinity" in any case are themselves. Nothing for all else:
/// hexadecimal numbers, decimal commas, cut exponents, blanks, the empty text.
std::optional<float> parse_float(std::string_view text);

/// Likewise for a double, but nothing for what is not finite.
std::optional<double> parse_finite_double(std::string_view text);

/// A decimal integer that is the whole of `text`, '-' and digits. Beyond 18 digits the result is
/// -10^18 or 10^18, which stands for "out of any range".
std::optional<std::int64_t> parse_integer(std::string_view text);

/// A hash as reports show it: 16 hexadecimal digits.
std::string hash_text(std::uint64_t hash);

}  // namespace morphray
