// What all targets of scene_positions.cpp share.
#pragma once

namespace mray::cpu {

/// The positions of a run: some are not finite; or all are, and some lie outside of scene space.
enum MadePositions { kNotFinite, kSomeOutside, kAllInside };

}  // namespace mray::cpu
