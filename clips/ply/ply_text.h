// The elements of a PLY file in text.
#pragma once

#include <string>
#include <string_view>

#include "clips/ply/ply_header.h"
#include "clips/ply/ply_mesh.h"

namespace mray {

/// Reads the text after the header: a line for each item, blank lines left out. Coordinates are
/// correctly rounded to float whatever their type. Returns the bytes after the last item, without
/// blanks at their beginning. Throws Error: kBadInput with file and line, kLimit.
std::string_view read_ply_text(std::string_view text, const PlyHeader& header,
                               const std::string& name, PlyMesh& mesh);

}  // namespace mray
