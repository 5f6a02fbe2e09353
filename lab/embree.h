// Embree 3 or 4, whichever the build found (MORPHRAY_EMBREE), by one set of calls.
#pragma once

#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#ifdef __SSE2__
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <cstddef>
#include <memory>
#include <type_traits>

#include "common/interop/ray.h"

namespace mray::embree {

#if MORPHRAY_EMBREE == 3
inline constexpr bool kHasStreams = true;
using IntersectArguments = RTCIntersectContext;
using OccludedArguments = RTCIntersectContext;
#else
inline constexpr bool kHasStreams = false;
using IntersectArguments = RTCIntersectArguments;
using OccludedArguments = RTCOccludedArguments;
#endif

struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
    void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

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

/// Whether rays that are traced one after the other are alike, for which Embree has other ways.
enum class Coherence { kCoherent, kIncoherent };

/// What Embree takes beside the rays: the context of version 3, the arguments of version 4. For one
/// thread at a time; packets have -1 in `valid` for active rays, else 0.
class Query {
public:
    explicit Query(Coherence coherence) {
        const bool is_coherent = coherence == Coherence::kCoherent;
#if MORPHRAY_EMBREE == 3
        rtcInitIntersectContext(&intersect_);
        intersect_.flags = is_coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                       : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        occluded_ = intersect_;
#else
        rtcInitIntersectArguments(&intersect_);
        rtcInitOccludedArguments(&occluded_);
        intersect_.flags = occluded_.flags =
            is_coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
#endif
    }

    void trace(RTCScene scene, RTCRayHit& ray, const int*) {
        call(rtcIntersect1, intersect_, ray, scene);
    }
    void trace(RTCScene scene, RTCRay& ray, const int*) {
        call(rtcOccluded1, occluded_, ray, scene);
    }
#define MORPHRAY_TRACE_PACKET(n)                                       \
    void trace(RTCScene scene, RTCRayHit##n& rays, const int* valid) { \
        call(rtcIntersect##n, intersect_, rays, valid, scene);         \
    }                                                                  \
    void trace(RTCScene scene, RTCRay##n& rays, const int* valid) {    \
        call(rtcOccluded##n, occluded_, rays, valid, scene);           \
    }
    MORPHRAY_TRACE_PACKET(4)
    MORPHRAY_TRACE_PACKET(8)
    MORPHRAY_TRACE_PACKET(16)
#undef MORPHRAY_TRACE_PACKET

    /// Single rays that lie one after the other; only if kHasStreams.
    void stream([[maybe_unused]] RTCScene scene, [[maybe_unused]] RTCRayHit* rays,
                [[maybe_unused]] std::size_t count) {
#if MORPHRAY_EMBREE == 3
        rtcIntersect1M(scene, &intersect_, rays, static_cast<unsigned int>(count), sizeof(*rays));
#endif
    }
    void stream([[maybe_unused]] RTCScene scene, [[maybe_unused]] RTCRay* rays,
                [[maybe_unused]] std::size_t count) {
#if MORPHRAY_EMBREE == 3
        rtcOccluded1M(scene, &occluded_, rays, static_cast<unsigned int>(count), sizeof(*rays));
#endif
    }

private:
    template <class Function, class Arguments, class Record, class... Leading>
    static void call(Function& function, Arguments& arguments, Record& record, Leading... leading) {
#if MORPHRAY_EMBREE == 3
        function(leading..., &arguments, &record);
#else
        function(leading..., &record, &arguments);
#endif
    }

    IntersectArguments intersect_;
    OccludedArguments occluded_;
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

template <class RayRecord>
void set_ray(RayRecord& record, std::size_t i, const Ray& ray) {
    copy_ray(record, i, ray);
    lane(record.time, i) = 0;
    lane(record.mask, i) = 0xFFFFFFFFu;
    lane(record.id, i) = 0;
    lane(record.flags, i) = 0;
}

/// Lane i has no hit yet, of an RTCRayHit, RTCRayHit4 and so on.
template <class HitRecord>
void clear_hit(HitRecord& record, std::size_t i) {
    lane(record.hit.geomID, i) = RTC_INVALID_GEOMETRY_ID;
    lane(record.hit.primID, i) = RTC_INVALID_GEOMETRY_ID;
}

template <class HitRecord>
Hit hit_of(const HitRecord& record, std::size_t i) {
    const unsigned int prim_id = lane(record.hit.primID, i);
    if (prim_id == RTC_INVALID_GEOMETRY_ID) return no_hit();
    return {lane(record.ray.tfar, i), lane(record.hit.u, i), lane(record.hit.v, i), prim_id};
}

}  // namespace mray::embree
