// Ray records of Embree, how they are made and traced, and its mode for denormals.
#pragma once

#ifdef __SSE2__
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "common/interop/camera.h"
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

/// N rays: their records and the functions that trace them. A single ray has no mask.
template <int N>
struct EmbreeCalls;
template <>
struct EmbreeCalls<1> {
    using RayRecord = RTCRay;
    using HitRecord = RTCRayHit;
};
template <>
struct EmbreeCalls<4> {
    using RayRecord = RTCRay4;
    using HitRecord = RTCRayHit4;
    static constexpr auto& intersect = rtcIntersect4;
    static constexpr auto& occluded = rtcOccluded4;
};
template <>
struct EmbreeCalls<8> {
    using RayRecord = RTCRay8;
    using HitRecord = RTCRayHit8;
    static constexpr auto& intersect = rtcIntersect8;
    static constexpr auto& occluded = rtcOccluded8;
};
template <>
struct EmbreeCalls<16> {
    using RayRecord = RTCRay16;
    using HitRecord = RTCRayHit16;
    static constexpr auto& intersect = rtcIntersect16;
    static constexpr auto& occluded = rtcOccluded16;
};

/// Traces a packet of N rays (1: a single ray) for any hits, or for the closest ones.
template <int N, bool kAnyHit, class Record>
void call_embree(const int* mask, RTCScene scene, embree::Query& query, Record& record) {
    if constexpr (N == 1 && kAnyHit) {
        query.occluded1(scene, record);
    } else if constexpr (N == 1) {
        query.intersect1(scene, record);
    } else if constexpr (kAnyHit) {
        query.occluded(EmbreeCalls<N>::occluded, mask, scene, record);
    } else {
        query.intersect(EmbreeCalls<N>::intersect, mask, scene, record);
    }
}

}  // namespace mray::bench
