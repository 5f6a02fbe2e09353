// Ray records of Embree, and its mode for denormals.
#pragma once

#ifdef __SSE2__
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <cstddef>

#include "common/interop/ray.h"
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

// Lane i of a packet's field, which is a scalar in records of one ray.
template <class T>
T& lane(T& field, std::size_t) {
    return field;
}
template <class T, std::size_t N>
T& lane(T (&field)[N], std::size_t i) {
    return field[i];
}

template <class T>
T read_lane(const T& field, std::size_t) {
    return field;
}
template <class T, std::size_t N>
T read_lane(const T (&field)[N], std::size_t i) {
    return field[i];
}

/// Sets the members that differ from ray to ray, in lane i of an RTCRay, RTCRay4 and so on.
template <class RayRecord>
void copy_ray(RayRecord& record, std::size_t i, const Ray& ray) {
    lane(record.org_x, i) = ray.org.x;
    lane(record.org_y, i) = ray.org.y;
    lane(record.org_z, i) = ray.org.z;
    lane(record.tnear, i) = ray.tnear;
    lane(record.dir_x, i) = ray.dir.x;
    lane(record.dir_y, i) = ray.dir.y;
    lane(record.dir_z, i) = ray.dir.z;
    lane(record.tfar, i) = ray.tfar;
}

/// Sets all members of lane i.
template <class RayRecord>
void set_ray(RayRecord& record, std::size_t i, const Ray& ray) {
    copy_ray(record, i, ray);
    lane(record.time, i) = 0;
    lane(record.mask, i) = 0xFFFFFFFFu;
    lane(record.id, i) = 0;
    lane(record.flags, i) = 0;
}

/// Coherent rays are those that start at one point.
inline embree::Coherence coherence_of(const TraceWork& work) {
    return work.kind == WorkKind::kDiffuse || work.kind == WorkKind::kAo
               ? embree::Coherence::kIncoherent
               : embree::Coherence::kCoherent;
}

}  // namespace mray::bench
