// The known name that a mistyped one probably means.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace mray {

/// The least number of insertions, deletions, replacements and swaps of neighbouring characters
/// that turn one text into the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name with the least edit distance to `text`, the first of equals; empty without names. Of a
/// longer text the first 64 characters count.
std::string nearest_name(std::string_view text, std::span<const std::string> names);

/// As nearest_name, but empty if about half of the characters or more would have to change, or if
/// `text` is longer than 64 characters.
std::string similar_name(std::string_view text, std::span<const std::string> names);

/// "; did you mean NAME?" with the similar name; empty without one.
std::string suggestion(std::string_view text, std::span<const std::string> names);

}  // namespace mray
