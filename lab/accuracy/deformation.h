// Speed and accuracy while a tree degrades: ways to update it, over the frames of an animation.
#pragma once

#include <string>

#include "lab/accuracy/charts.h"

namespace mray::lab {

/// Camera rays, and rays at vertices and edges, over the frames of an animation, by our packets
/// over a tree that is refitted, restructured or rebuilt, and by the packets of 2007 over their
/// own, refitted or rebuilt: speed and time of each frame, and speed against wrong answers. `input`
/// has at least two frames.
Chart deformation_chart(const ChartContext& context, const ChartInput& input,
                        const std::string& suffix);

}  // namespace mray::lab
