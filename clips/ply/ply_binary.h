// The elements of a binary PLY file.
#pragma once

#include <string>

#include "clips/ply/ply_header.h"
#include "clips/ply/ply_mesh.h"
#include "common/base/input_file.h"

namespace mray {

/// Reads what follows the header, in parts of a fixed size. Returns the offset of the first byte
/// after the last item. Throws Error: kBadInput with the file and the offset of the fault, kLimit.
std::uint64_t read_ply_binary(const InputFile& file, const PlyHeader& header,
                              const std::string& name, PlyMesh& mesh);

}  // namespace mray
