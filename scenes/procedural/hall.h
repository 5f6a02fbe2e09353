// The built-in scene of a hall, which is seen from inside.
#pragma once

#include "scenes/procedural/surfaces.h"

namespace mray {

/// x from -20 to 20, y from 0 to 9, z from -7 to 7. It has about as many triangles as asked for.
DeformingMesh make_hall(std::uint64_t triangles);

}  // namespace mray
