// Embree tracing secondary rays that are made from hits while they are traced.
#pragma once

#include "common/image/frame.h"
#include "cpu/image/pixel_shader.h"
#include "lab/bench/embree/embree_scene.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// Makes the rays of a shadow or ambient-occlusion work from the hits of `frame`, by SIMD, and
/// traces each by Occluded1 while it is in the cache, with the flag of embree_ways; tile by tile,
/// in the calling thread's arena. Fills the occlusion of the pixels that hit something.
void trace_pixels(const EmbreeScene& scene, const TraceWork& work, const cpu::ShadedMesh& mesh,
                  const cpu::PixelShader& shader, Frame& frame);

}  // namespace mray::bench
