// Embree's records and calls by packet size.
#pragma once

#include "lab/embree.h"

namespace mray::bench {

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

/// Traces single rays that lie one after the other as a stream, if Embree has streams.
template <bool kAnyHit, class Record>
void call_embree_stream(RTCScene scene, embree::Query& query, Record* records, std::size_t count) {
    if constexpr (kAnyHit) {
        query.occluded_stream(scene, records, count);
    } else {
        query.intersect_stream(scene, records, count);
    }
}

}  // namespace mray::bench
