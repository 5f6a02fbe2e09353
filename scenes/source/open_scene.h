// Opens clips by name.
#pragma once

#include <memory>
#include <string>

#include "scenes/clip.h"

namespace mray {

/// Opens `builtin:NAME[:TRIANGLES]`, a mesh file (OBJ or PLY), a folder of them, a pattern such
/// as `frame_%04d.obj`, or a .gltf or .glb file. Throws Error: kBadArgument (unknown builtin, bad
/// pattern, a cache for anything but one mesh file, an animation for anything but a glTF file that
/// has it), kBadInput, kLimit.
std::unique_ptr<Clip> open_scene(const std::string& spec, const ClipOptions& options = {});

}  // namespace mray
