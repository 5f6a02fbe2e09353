// Embree 3 or 4, whichever the build found (MORPHRAY_EMBREE), by one set of calls.
#pragma once

#if MORPHRAY_EMBREE == 3
#include <embree3/rtcore.h>
#else
#include <embree4/rtcore.h>
#endif

#include <cstddef>
#include <memory>
#include <type_traits>

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

/// Whether rays that are traced one after the other are alike, for which Embree has other ways.
enum class Coherence { kCoherent, kIncoherent };

/// All that Embree takes beside the rays: the context of version 3, the arguments of version 4. A
/// query belongs to one thread at a time; packets name the active rays by -1 in `valid`, the others
/// by 0.
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

    void intersect1(RTCScene scene, RTCRayHit& ray) { call(rtcIntersect1, intersect_, ray, scene); }
    /// `function` is rtcIntersect4, rtcIntersect8 or rtcIntersect16.
    template <class Function, class Packet>
    void intersect(Function& function, const int* valid, RTCScene scene, Packet& packet) {
        call(function, intersect_, packet, valid, scene);
    }
    void occluded1(RTCScene scene, RTCRay& ray) { call(rtcOccluded1, occluded_, ray, scene); }
    /// `function` is rtcOccluded4, rtcOccluded8 or rtcOccluded16.
    template <class Function, class Packet>
    void occluded(Function& function, const int* valid, RTCScene scene, Packet& packet) {
        call(function, occluded_, packet, valid, scene);
    }

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

}  // namespace mray::embree
