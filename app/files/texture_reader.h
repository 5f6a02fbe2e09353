// Reading of textures.
#pragma once

#include <string>
#include <vector>

#include "app/terminal/messages.h"
#include "common/image/png.h"
#include "common/scene/textures.h"

namespace mray::app {

/// The bytes of an image: of a file, of a part of one, or of what stands in one in base 64. Throws
/// Error: kBadInput for a file that cannot be read or does not have that part, and for a part above
/// 1 GiB; kLimit for a file above 1 GiB.
std::string texture_bytes(const TextureFile& file);

/// The image in a PNG or JPEG file, whatever its name, or in a part of any file. Throws Error:
/// kBadInput for an image of another kind and for a damaged one, kLimit for more pixels than a
/// texture may have or than there is memory for.
Image read_texture(const TextureFile& file);

/// The images of all textures, in their order. If lenient, one that cannot be used is a warning and
/// a white pixel; otherwise throws what read_texture() throws.
std::vector<Image> read_textures(const SceneTextures& textures, bool lenient,
                                 const Messages& messages);

}  // namespace mray::app
