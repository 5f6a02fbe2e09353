// Buffer views that the extension EXT_meshopt_compression compresses.
#pragma once

#include <span>
#include <string>

#include "scenes/gltf/file/gltf_file.h"

namespace mray::gltf {

/// The content of a buffer view of which the extension says `compression`. Takes its bytes from the
/// budget, and adds what reading it may take. Throws Error(kBadInput) with the place in the JSON
/// for sizes that do not fit each other or the buffer, and for bytes that are not what the
/// extension says.
std::string decompressed(const JsonAt& view, const JsonAt& compression,
                         std::span<const Buffer> buffers, ContentBudget& budget);

}  // namespace mray::gltf
