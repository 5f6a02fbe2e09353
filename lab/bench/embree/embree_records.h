// Packets of Embree as they are made from the rays of works, and its mode for denormals.
#pragma once

#ifdef __SSE2__
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "common/interop/camera.h"
#include "lab/bench/trace_work.h"
#include "lab/embree.h"

namespace mray::bench {

/// Treats denormals as zeros while it lives, as Embree requires for tracing.
class FlushedDenormals {
public:
#ifdef __SSE2__
    FlushedDenormals() : saved_(_mm_getcsr()) {
        _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
        _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    }
    ~FlushedDenormals() { _mm_setcsr(saved_); }

private:
    unsigned int saved_;
#else
    FlushedDenormals() {}
    ~FlushedDenormals() {}
#endif
};

/// Coherent rays are those that start at one point.
inline embree::Coherence coherence_of(const TraceWork& work) {
    return work.kind == WorkKind::kDiffuse || work.kind == WorkKind::kAo
               ? embree::Coherence::kIncoherent
               : embree::Coherence::kCoherent;
}

/// The camera rays of a block of 4 x 4 pixels, row by row.
inline void make_camera_rays(const Camera& camera, std::uint32_t x0, std::uint32_t y0,
                             RTCRay16& record) {
    for (std::uint32_t i = 0; i < kPacketSize; ++i) {
        const vec3 dir =
            canonical_direction(camera_direction(camera, x0 + i % kBlockSize, y0 + i / kBlockSize));
        record.dir_x[i] = dir.x;
        record.dir_y[i] = dir.y;
        record.dir_z[i] = dir.z;
        record.tnear[i] = 0;
        record.tfar[i] = kInfiniteT;
    }
}

/// Copies directions and ends; the origin is that of the record.
inline void copy_shadow_rays(const cpu::SharedOriginRays& rays, RTCRay16& record) {
    std::memcpy(record.dir_x, rays.dir[0], sizeof(rays.dir[0]));
    std::memcpy(record.dir_y, rays.dir[1], sizeof(rays.dir[1]));
    std::memcpy(record.dir_z, rays.dir[2], sizeof(rays.dir[2]));
    std::memcpy(record.tfar, rays.tfar, sizeof(rays.tfar));
    std::memset(record.tnear, 0, sizeof(record.tnear));
}

}  // namespace mray::bench
