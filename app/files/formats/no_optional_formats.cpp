#include "app/files/formats/optional_formats.h"

namespace mray::app {

std::span<const MeshFormat> optional_mesh_formats() { return {}; }

}  // namespace mray::app
