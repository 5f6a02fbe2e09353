// rtcIntersect* and rtcOccluded*.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "library/embree/device.h"
#include "library/embree/queries/layouts.h"
#include "library/embree/queries/query.h"
#include "library/embree/scene/scene.h"

namespace mray::embree {
namespace {

constexpr float kOccluded = -std::numeric_limits<float>::infinity();
// Packets of fewer rays are traced one by one.
constexpr std::size_t kFewRays = 4;
// Rays of a stream that are traced together: an image of 256 x 256.
constexpr std::size_t kBatch = std::size_t{1} << 16;

/// Throws Failure if there is none.
const Committed& committed_of(RTCScene handle, const void* rays) {
    const auto* const scene = reinterpret_cast<const SceneObject*>(handle);
    if (scene == nullptr) fail_argument("the scene is null");
    if (rays == nullptr) fail_argument("the rays are null");
    return scene->committed();
}

Device* device_of(RTCScene handle) {
    const auto* const scene = reinterpret_cast<const SceneObject*>(handle);
    return scene == nullptr ? nullptr : &scene->device();
}

void intersect_one(const Query& query, RTCRayHit& rayhit) {
    const morphray::Ray traced = query.to_trace(rayhit.ray);
    if (query.has_filters()) {
        const morphray::Hit found = query.scene().intersect(traced);
        if (found) query.settle(found, traced, rayhit.ray, rayhit.hit);
        return;
    }
    const morphray::Hit found = query.intersect(traced, rayhit.ray.mask);
    if (!found) return;
    rayhit.ray.tfar = found.t;
    query.set_hit(found, rayhit.hit);
}

void occlude_one(const Query& query, RTCRay& ray) {
    const morphray::Ray traced = query.to_trace(ray);
    if (query.takes_any_hit(ray.mask)) {
        if (query.scene().occluded(traced)) ray.tfar = kOccluded;
        return;
    }
    if (!query.has_filters()) {
        if (query.intersect(traced, ray.mask)) ray.tfar = kOccluded;
        return;
    }
    const morphray::Hit found = query.scene().intersect(traced);
    RTCHit hit;
    if (found && query.settle(found, traced, ray, hit)) ray.tfar = kOccluded;
}

/// Stores a hit that is let through in its lane.
template <Query::Kind kind, class Lane>
void store(const Query& query, const morphray::Hit& found, const Lane& lane) {
    if constexpr (kind == Query::Kind::occlusion) {
        lane.store_tfar(kOccluded);
    } else {
        lane.store_tfar(found.t);
        if constexpr (std::is_same_v<Lane, OneLane>) {
            query.set_hit(found, lane.hit());
        } else {
            RTCHit hit;
            query.set_hit(found, hit);
            lane.store_hit(hit);
        }
    }
}

/// Stores the first hit that is let through, if there is one: this one or one after it.
template <Query::Kind kind, class Lane>
void store_first(const Query& query, const morphray::Hit& found, const morphray::Ray& traced,
                 const Lane& lane) {
    if (!query.has_filters()) {
        const morphray::Hit seen = query.seen_hit(found, traced, lane.load().mask);
        if (seen) store<kind>(query, seen, lane);
        return;
    }
    RTCRay ray = lane.load();
    RTCHit hit;
    if (!query.settle(found, traced, ray, hit)) return;
    if constexpr (kind == Query::Kind::occlusion) {
        lane.store_tfar(kOccluded);
    } else {
        lane.store_tfar(ray.tfar);
        lane.store_hit(hit);
    }
}

/// Rays on their way through the tracer. The memory stays with the thread, since fresh memory takes
/// longer than the rays: up to 4 MB.
struct Batch {
    std::vector<std::uint32_t> active;
    std::vector<morphray::Ray> rays;
    std::vector<morphray::Hit> hits;
    std::vector<std::uint8_t> occluded;

    void resize(std::size_t count) {
        if (count <= active.size()) return;
        rays.resize(count);
        hits.resize(count);
        occluded.resize(count);
        // The last one: its size says that the others have theirs.
        active.resize(count);
    }
};

/// Traces the rays with the first `count` numbers of batch.active, in this thread.
template <Query::Kind kind, class Layout>
void trace_batch(const Query& query, const Layout& rays, Batch& batch, std::size_t count) {
    // A filter may trace other rays.
    Batch mine = std::exchange(batch, {});
    const auto traced = std::span(mine.rays).first(count);
    bool takes_any_hit = true;
    for (std::size_t k = 0; k < count; ++k) {
        const RTCRay& ray = rays[mine.active[k]].load();
        traced[k] = query.to_trace(ray);
        takes_any_hit = takes_any_hit && query.takes_any_hit(ray.mask);
    }
    if (kind == Query::Kind::occlusion && takes_any_hit) {
        const auto occluded = std::span(mine.occluded).first(count);
        query.scene().occluded(traced, occluded, morphray::Threads::calling);
        for (std::size_t k = 0; k < count; ++k)
            if (occluded[k] != 0) rays[mine.active[k]].store_tfar(kOccluded);
    } else {
        const auto found = std::span(mine.hits).first(count);
        query.scene().intersect(traced, found, morphray::Threads::calling);
        for (std::size_t k = 0; k < count; ++k) {
            if (!found[k]) continue;
            const auto lane = rays[mine.active[k]];
            if (takes_any_hit) {
                store<kind>(query, found[k], lane);
            } else {
                store_first<kind>(query, found[k], traced[k], lane);
            }
        }
    }
    batch = std::move(mine);
}

/// Traces one ray of a layout.
template <Query::Kind kind, class Lane>
void trace_lane(const Query& query, const Lane& lane) {
    RTCRay ray = lane.load();
    if constexpr (kind == Query::Kind::occlusion) {
        occlude_one(query, ray);
        if (ray.tfar == kOccluded) lane.store_tfar(kOccluded);
    } else {
        const morphray::Ray traced = query.to_trace(ray);
        if (query.has_filters()) {
            const morphray::Hit found = query.scene().intersect(traced);
            if (found) store_first<kind>(query, found, traced, lane);
            return;
        }
        const morphray::Hit found = query.intersect(traced, ray.mask);
        if (found) store<kind>(query, found, lane);
    }
}

/// Traces `count` rays, those of them with valid[i] == -1 if it is given.
template <Query::Kind kind, class Layout>
void trace(const char* call, RTCScene scene, const QueryOptions& options, const void* first,
           const Layout& rays, std::size_t count, const int* valid) noexcept {
    guarded(call, device_of(scene), [&] {
        const Query query(committed_of(scene, first), options, kind);
        if (!query.committed().scene) return;
        thread_local Batch batch;
        for (std::size_t begin = 0; begin < count; begin += kBatch) {
            const std::size_t end = std::min(count, begin + kBatch);
            batch.resize(end - begin);
            std::size_t size = 0;
            for (std::size_t i = begin; i < end; ++i)
                if (valid == nullptr || valid[i] == -1)
                    batch.active[size++] = static_cast<std::uint32_t>(i);
            if (size >= kFewRays) {
                trace_batch<kind>(query, rays, batch, size);
                continue;
            }
            std::array<std::uint32_t, kFewRays> few;
            std::copy_n(batch.active.begin(), size, few.begin());
            for (std::size_t k = 0; k < size; ++k) trace_lane<kind>(query, rays[few[k]]);
        }
    });
}

template <Query::Kind kind>
void trace_packet(const char* call, RTCScene scene, const QueryOptions& options, void* rays,
                  std::size_t n, const int* valid) noexcept {
    if (valid == nullptr) rays = nullptr;
    trace<kind>(call, scene, options, rays, Packet{static_cast<float*>(rays), n}, n, valid);
}

void intersect1(RTCScene scene, const QueryOptions& options, RTCRayHit* rayhit) noexcept {
    guarded("rtcIntersect1", device_of(scene), [&] {
        const Query query(committed_of(scene, rayhit), options, Query::Kind::closest);
        if (query.committed().scene) intersect_one(query, *rayhit);
    });
}

void occluded1(RTCScene scene, const QueryOptions& options, RTCRay* ray) noexcept {
    guarded("rtcOccluded1", device_of(scene), [&] {
        const Query query(committed_of(scene, ray), options, Query::Kind::occlusion);
        if (query.committed().scene) occlude_one(query, *ray);
    });
}

constexpr Query::Kind kClosest = Query::Kind::closest;
constexpr Query::Kind kOcclusion = Query::Kind::occlusion;

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

#if MORPHRAY_EMBREE == 3

void rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* rayhit) {
    intersect1(scene, options_of(context), rayhit);
}
void rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
    occluded1(scene, options_of(context), ray);
}
void rtcIntersect4(const int* valid, RTCScene scene, RTCIntersectContext* context,
                   RTCRayHit4* rays) {
    trace_packet<kClosest>("rtcIntersect4", scene, options_of(context), rays, 4, valid);
}
void rtcIntersect8(const int* valid, RTCScene scene, RTCIntersectContext* context,
                   RTCRayHit8* rays) {
    trace_packet<kClosest>("rtcIntersect8", scene, options_of(context), rays, 8, valid);
}
void rtcIntersect16(const int* valid, RTCScene scene, RTCIntersectContext* context,
                    RTCRayHit16* rays) {
    trace_packet<kClosest>("rtcIntersect16", scene, options_of(context), rays, 16, valid);
}
void rtcOccluded4(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay4* rays) {
    trace_packet<kOcclusion>("rtcOccluded4", scene, options_of(context), rays, 4, valid);
}
void rtcOccluded8(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay8* rays) {
    trace_packet<kOcclusion>("rtcOccluded8", scene, options_of(context), rays, 8, valid);
}
void rtcOccluded16(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRay16* rays) {
    trace_packet<kOcclusion>("rtcOccluded16", scene, options_of(context), rays, 16, valid);
}

void rtcIntersect1M(RTCScene scene, RTCIntersectContext* context, RTCRayHit* rays, unsigned int m,
                    size_t stride) {
    trace<kClosest>("rtcIntersect1M", scene, options_of(context), rays,
                    Stream{reinterpret_cast<char*>(rays), stride}, m, nullptr);
}
void rtcOccluded1M(RTCScene scene, RTCIntersectContext* context, RTCRay* rays, unsigned int m,
                   size_t stride) {
    trace<kOcclusion>("rtcOccluded1M", scene, options_of(context), rays,
                      Stream{reinterpret_cast<char*>(rays), stride}, m, nullptr);
}
void rtcIntersect1Mp(RTCScene scene, RTCIntersectContext* context, RTCRayHit** rays,
                     unsigned int m) {
    trace<kClosest>("rtcIntersect1Mp", scene, options_of(context), rays,
                    Pointers{reinterpret_cast<void**>(rays)}, m, nullptr);
}
void rtcOccluded1Mp(RTCScene scene, RTCIntersectContext* context, RTCRay** rays, unsigned int m) {
    trace<kOcclusion>("rtcOccluded1Mp", scene, options_of(context), rays,
                      Pointers{reinterpret_cast<void**>(rays)}, m, nullptr);
}
void rtcIntersectNM(RTCScene scene, RTCIntersectContext* context, RTCRayHitN* rays, unsigned int n,
                    unsigned int m, size_t stride) {
    trace<kClosest>("rtcIntersectNM", scene, options_of(context), rays,
                    PacketStream{reinterpret_cast<char*>(rays), n, stride}, std::size_t{n} * m,
                    nullptr);
}
void rtcOccludedNM(RTCScene scene, RTCIntersectContext* context, RTCRayN* rays, unsigned int n,
                   unsigned int m, size_t stride) {
    trace<kOcclusion>("rtcOccludedNM", scene, options_of(context), rays,
                      PacketStream{reinterpret_cast<char*>(rays), n, stride}, std::size_t{n} * m,
                      nullptr);
}
void rtcIntersectNp(RTCScene scene, RTCIntersectContext* context, const RTCRayHitNp* rays,
                    unsigned int n) {
    trace<kClosest>("rtcIntersectNp", scene, options_of(context), rays,
                    Arrays{&rays->ray, &rays->hit}, n, nullptr);
}
void rtcOccludedNp(RTCScene scene, RTCIntersectContext* context, const RTCRayNp* rays,
                   unsigned int n) {
    trace<kOcclusion>("rtcOccludedNp", scene, options_of(context), rays, Arrays{rays, nullptr}, n,
                      nullptr);
}

#else

void rtcIntersect1(RTCScene scene, RTCRayHit* rayhit, RTCIntersectArguments* arguments) {
    intersect1(scene, options_of(arguments), rayhit);
}
void rtcOccluded1(RTCScene scene, RTCRay* ray, RTCOccludedArguments* arguments) {
    occluded1(scene, options_of(arguments), ray);
}
void rtcIntersect4(const int* valid, RTCScene scene, RTCRayHit4* rays,
                   RTCIntersectArguments* arguments) {
    trace_packet<kClosest>("rtcIntersect4", scene, options_of(arguments), rays, 4, valid);
}
void rtcIntersect8(const int* valid, RTCScene scene, RTCRayHit8* rays,
                   RTCIntersectArguments* arguments) {
    trace_packet<kClosest>("rtcIntersect8", scene, options_of(arguments), rays, 8, valid);
}
void rtcIntersect16(const int* valid, RTCScene scene, RTCRayHit16* rays,
                    RTCIntersectArguments* arguments) {
    trace_packet<kClosest>("rtcIntersect16", scene, options_of(arguments), rays, 16, valid);
}
void rtcOccluded4(const int* valid, RTCScene scene, RTCRay4* rays,
                  RTCOccludedArguments* arguments) {
    trace_packet<kOcclusion>("rtcOccluded4", scene, options_of(arguments), rays, 4, valid);
}
void rtcOccluded8(const int* valid, RTCScene scene, RTCRay8* rays,
                  RTCOccludedArguments* arguments) {
    trace_packet<kOcclusion>("rtcOccluded8", scene, options_of(arguments), rays, 8, valid);
}
void rtcOccluded16(const int* valid, RTCScene scene, RTCRay16* rays,
                   RTCOccludedArguments* arguments) {
    trace_packet<kOcclusion>("rtcOccluded16", scene, options_of(arguments), rays, 16, valid);
}

#endif
