// The arguments of a map_Kd statement.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "clips/obj/mtl_reader.h"

namespace mray {

/// The characters between the words of a material library.
inline constexpr std::string_view kMtlBlanks = " \t\f";

struct ParsedMap {
    /// Without place and library. `file` is empty if the statement names none.
    TextureMap map;
    /// Why the statement cannot be used; empty if it can.
    std::string problem;
    /// The first option that is ignored although it would change the image; empty if none is.
    std::string ignored;
};

/// Reads `[-option value ...] file`. A file name is all that follows the options, and may have
/// blanks in it and quotes around it.
ParsedMap parse_texture_map(std::string_view arguments);

}  // namespace mray
