// Checks a frame against ClipOptions::bounds.
#pragma once

#include <string>

#include "common/scene/world_bounds.h"

namespace mray {

/// Throws Error(kBadInput), which names the file, the frame, the axis and how far the frame
/// reaches, if `bounds`, those of the frame, are not within `given`. Empty bounds are.
void require_within_given(const WorldBounds& bounds, const WorldBounds& given,
                          const std::string& file, double frame);

}  // namespace mray
