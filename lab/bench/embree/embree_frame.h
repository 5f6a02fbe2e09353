// Embree tracing the image of a frame.
#pragma once

#include "common/image/frame.h"
#include "common/interop/params.h"
#include "cpu/image/pixel_shader.h"
#include "lab/bench/embree/embree_scene.h"

namespace mray::bench {

/// Traces camera rays and shadow rays by Intersect16 and Occluded16 with the flag COHERENT, 4 x 4
/// pixels at a time, and has `shader` make shadow rays and colours: all of a square of pixels while
/// it is in the cache, in the calling thread's arena. The frame has the size of the image. The
/// sides of the image are multiples of 32.
void trace_frame(const EmbreeScene& scene, const ImageParams& params, const cpu::ShadedMesh& mesh,
                 const cpu::PixelShader& shader, Frame& frame);

}  // namespace mray::bench
