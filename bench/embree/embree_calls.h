// Embree's records and calls by packet size.
#pragma once

#include <embree3/rtcore.h>

namespace mray::bench {

/// N rays: their records and the calls that trace them. A single ray has no mask.
template <int N>
struct EmbreeCalls;
template <>
struct EmbreeCalls<1> {
    using RayRecord = RTCRay;
    using HitRecord = RTCRayHit;
    static void intersect(const int*, RTCScene scene, RTCIntersectContext* context, HitRecord* r) {
        rtcIntersect1(scene, context, r);
    }
    static void occluded(const int*, RTCScene scene, RTCIntersectContext* context, RayRecord* r) {
        rtcOccluded1(scene, context, r);
    }
};
template <>
struct EmbreeCalls<4> {
    using RayRecord = RTCRay4;
    using HitRecord = RTCRayHit4;
    static constexpr auto* intersect = rtcIntersect4;
    static constexpr auto* occluded = rtcOccluded4;
};
template <>
struct EmbreeCalls<8> {
    using RayRecord = RTCRay8;
    using HitRecord = RTCRayHit8;
    static constexpr auto* intersect = rtcIntersect8;
    static constexpr auto* occluded = rtcOccluded8;
};
template <>
struct EmbreeCalls<16> {
    using RayRecord = RTCRay16;
    using HitRecord = RTCRayHit16;
    static constexpr auto* intersect = rtcIntersect16;
    static constexpr auto* occluded = rtcOccluded16;
};

/// Traces a packet of N rays (1: a single ray) for any hits, or for the closest ones.
template <int N, bool kAnyHit, class Record>
void call_embree(const int* mask, RTCScene scene, RTCIntersectContext& context, Record& record) {
    if constexpr (kAnyHit) {
        EmbreeCalls<N>::occluded(mask, scene, &context, &record);
    } else {
        EmbreeCalls<N>::intersect(mask, scene, &context, &record);
    }
}

/// Traces single rays that lie one after the other as a stream.
inline void call_embree_stream(RTCScene scene, RTCIntersectContext& context, RTCRay* records,
                               std::size_t count) {
    rtcOccluded1M(scene, &context, records, static_cast<unsigned int>(count), sizeof(RTCRay));
}
inline void call_embree_stream(RTCScene scene, RTCIntersectContext& context, RTCRayHit* records,
                               std::size_t count) {
    rtcIntersect1M(scene, &context, records, static_cast<unsigned int>(count), sizeof(RTCRayHit));
}

}  // namespace mray::bench
