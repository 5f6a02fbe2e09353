// "Did you mean ...?"
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace morphray::app {

/// Insertions, deletions, replacements and swaps of neighbours that turn one text into the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name that is most like `text`; empty when none comes near.
std::string nearest_name(std::string_view text, std::span<const std::string> names);

}  // namespace morphray::app
