// Embree tracing a picture as a program does that has pixels, and no rays yet.
#pragma once

#include <span>

#include "bench/embree_scene.h"
#include "bench/trace_work.h"
#include "common/frame.h"

namespace morphray::bench {

/// Makes each ray of a work from its pixel and traces it at once by Intersect1 or Occluded1, with
/// the flags of embree_ways; tile by tile, in the calling thread's arena. The rays are those of the
/// work, but made by it: shadow and ambient-occlusion rays from `seen`, the hits of the camera's
/// rays, row by row as in a picture. Of `frame`, which has the size of the picture, primary rays
/// fill hits, the others occlusion; what they do not fill stays.
void trace_pixels(const EmbreeScene& scene, const TraceWork& work, const cpu::ShadedMesh& mesh,
                  std::span<const Hit> seen, Frame& frame);

}  // namespace morphray::bench
