// Embree 3 or 4, whichever the build found (MORPHRAY_EMBREE), by one set of calls.
#pragma once

#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <cstddef>

namespace mray::embree {

/// Whether rays that are traced one after the other are alike, for which Embree has other ways.
enum class Coherence { kCoherent, kIncoherent };

/// All that Embree takes beside the rays: the context of version 3, the arguments of version 4. A
/// query belongs to one thread at a time; packets name the active rays by -1 in `valid`, the others
/// by 0.
class Query {
public:
    explicit Query(Coherence coherence);

    void intersect1(RTCScene scene, RTCRayHit& ray);
    /// `function` is rtcIntersect4, rtcIntersect8 or rtcIntersect16.
    template <class Function, class Packet>
    void intersect(Function& function, const int* valid, RTCScene scene, Packet& packet);

    void occluded1(RTCScene scene, RTCRay& ray);
    /// `function` is rtcOccluded4, rtcOccluded8 or rtcOccluded16.
    template <class Function, class Packet>
    void occluded(Function& function, const int* valid, RTCScene scene, Packet& packet);

    /// Single rays that lie one after the other; only if kHasStreams.
    void intersect_stream(RTCScene scene, RTCRayHit* rays, std::size_t count);
    void occluded_stream(RTCScene scene, RTCRay* rays, std::size_t count);

private:
#if MORPHRAY_EMBREE == 3
    RTCIntersectContext context_;
#else
    RTCIntersectArguments intersect_;
    RTCOccludedArguments occluded_;
#endif
};

#if MORPHRAY_EMBREE == 3

inline constexpr bool kHasStreams = true;

inline Query::Query(Coherence coherence) {
    rtcInitIntersectContext(&context_);
    context_.flags = coherence == Coherence::kCoherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                       : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
}

inline void Query::intersect1(RTCScene scene, RTCRayHit& ray) {
    rtcIntersect1(scene, &context_, &ray);
}
template <class Function, class Packet>
void Query::intersect(Function& function, const int* valid, RTCScene scene, Packet& packet) {
    function(valid, scene, &context_, &packet);
}

inline void Query::occluded1(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &context_, &ray); }
template <class Function, class Packet>
void Query::occluded(Function& function, const int* valid, RTCScene scene, Packet& packet) {
    function(valid, scene, &context_, &packet);
}

inline void Query::intersect_stream(RTCScene scene, RTCRayHit* rays, std::size_t count) {
    rtcIntersect1M(scene, &context_, rays, static_cast<unsigned int>(count), sizeof(RTCRayHit));
}
inline void Query::occluded_stream(RTCScene scene, RTCRay* rays, std::size_t count) {
    rtcOccluded1M(scene, &context_, rays, static_cast<unsigned int>(count), sizeof(RTCRay));
}

#else

inline constexpr bool kHasStreams = false;

inline Query::Query(Coherence coherence) {
    const RTCRayQueryFlags flags = coherence == Coherence::kCoherent
                                       ? RTC_RAY_QUERY_FLAG_COHERENT
                                       : RTC_RAY_QUERY_FLAG_INCOHERENT;
    rtcInitIntersectArguments(&intersect_);
    intersect_.flags = flags;
    rtcInitOccludedArguments(&occluded_);
    occluded_.flags = flags;
}

inline void Query::intersect1(RTCScene scene, RTCRayHit& ray) {
    rtcIntersect1(scene, &ray, &intersect_);
}
template <class Function, class Packet>
void Query::intersect(Function& function, const int* valid, RTCScene scene, Packet& packet) {
    function(valid, scene, &packet, &intersect_);
}

inline void Query::occluded1(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray, &occluded_); }
template <class Function, class Packet>
void Query::occluded(Function& function, const int* valid, RTCScene scene, Packet& packet) {
    function(valid, scene, &packet, &occluded_);
}

#endif

}  // namespace mray::embree
