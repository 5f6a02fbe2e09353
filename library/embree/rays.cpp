// Embree's queries of rays, and the hits that masks and filters let through.
#include <bit>
#include <cstring>

#include "library/embree/scene.h"

namespace mray::embree {
namespace {

/// The members of a hit, of 4 bytes each. Behind them version 4 has bytes that are the caller's.
constexpr std::size_t kHitMembers = MORPHRAY_EMBREE == 3 ? 8 : 9;
void copy_hit(RTCHit& to, const RTCHit& from) { std::memcpy(&to, &from, 4 * kHitMembers); }

struct QueryOptions {
    Context* context = nullptr;
    /// The filter of context or arguments is null if there is none.
    RTCFilterFunctionN filter = nullptr;
    /// It is also called for geometries that have not asked for it.
    bool filters_all = false;
};

#if MORPHRAY_EMBREE == 3
QueryOptions options_of(const Context* context) {
    return {const_cast<Context*>(context), context == nullptr ? nullptr : context->filter, true};
}
#else
template <class Arguments>
QueryOptions options_of(const Arguments* arguments) {
    if (arguments == nullptr) return {};
    return {arguments->context, arguments->filter,
            (arguments->flags & RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER) != 0};
}
#endif

RTCRay to_object(const RTCRay& ray, const Transform& transform) {
    RTCRay result = ray;
    const morphray::Vec3 org = mapped(transform, {ray.org_x, ray.org_y, ray.org_z}, 1);
    const morphray::Vec3 dir = mapped(transform, {ray.dir_x, ray.dir_y, ray.dir_z}, 0);
    result.org_x = org.x;
    result.org_y = org.y;
    result.org_z = org.z;
    result.dir_x = dir.x;
    result.dir_y = dir.y;
    result.dir_z = dir.z;
    return result;
}

constexpr morphray::QueryOptions kCallingThread = {.threads = morphray::Threads::calling};

/// Answers the rays of a call in one thread.
class Query {
public:
    enum class Kind { closest, occlusion };

    Query(const Committed& committed, const QueryOptions& options, Kind kind)
        : committed_(committed),
          options_(options),
          kind_(kind),
          has_filters_(
              options.filter != nullptr ||
              (kind == Kind::closest ? committed.filters_hits : committed.filters_occlusion)) {}

    const Committed& committed() const { return committed_; }
    const morphray::Scene& scene() const { return *committed_.scene; }
    /// Intervals are closed in robust scenes and in the library, and open at tnear in others.
    morphray::Ray to_trace(const RTCRay& ray) const {
        float tnear = ray.tnear;
        if (!committed_.is_robust && tnear > 0)
            tnear = std::bit_cast<float>(std::bit_cast<std::uint32_t>(tnear) + 1);
        return {
            {ray.org_x, ray.org_y, ray.org_z}, tnear, {ray.dir_x, ray.dir_y, ray.dir_z}, ray.tfar};
    }
    /// Returns true if the first hit of a ray with this mask is let through.
    bool takes_any_hit(unsigned int ray_mask) const {
        return !has_filters_ && std::ranges::all_of(committed_.masks, [&](unsigned int mask) {
            return (mask & ray_mask) != 0;
        });
    }
    void prefetch(const morphray::Hit& found) const {
        if (found) __builtin_prefetch(&committed_.meshes[found.geom_id].normals[found.prim_id]);
    }
    /// One by one: a copy of a record that was just written would wait for the cache.
    void set_hit(const morphray::Hit& found, RTCHit& hit) const {
        const CommittedMesh& mesh = committed_.meshes[found.geom_id];
        const morphray::Vec3 normal = mesh.normals[found.prim_id];
        hit.Ng_x = normal.x;
        hit.Ng_y = normal.y;
        hit.Ng_z = normal.z;
        const bool is_second = mesh.is_quads && found.prim_id % 2 != 0;
        hit.u = is_second ? 1 - found.u : found.u;
        hit.v = is_second ? 1 - found.v : found.v;
        hit.primID = mesh.prim_id(found.prim_id);
        hit.geomID = mesh.geom_id;
        const bool is_instance = mesh.is_instance();
        const Context* const context = options_.context;
        hit.instID[0] = is_instance          ? mesh.inst_id
                        : context != nullptr ? context->instID[0]
                                             : kInvalid;
#if MORPHRAY_EMBREE == 4
        hit.instPrimID[0] = is_instance          ? 0
                            : context != nullptr ? context->instPrimID[0]
                                                 : kInvalid;
#endif
    }
    /// The first hit from the closest on that is let through. False: nothing has changed.
    bool settle(morphray::Hit found, const morphray::Ray& traced, RTCRay& ray, RTCHit& hit) const {
        for (; found; found = next(traced, found, ray.mask)) {
            const CommittedMesh& mesh = committed_.meshes[found.geom_id];
            if (!committed_.masks.empty() && !mesh.sees(ray.mask)) continue;
            RTCHit candidate;
            set_hit(found, candidate);
            const float tfar = std::exchange(ray.tfar, found.t);
            if (passes_filters(mesh, ray, candidate)) {
                copy_hit(hit, candidate);
                return true;
            }
            ray.tfar = tfar;
        }
        return false;
    }

private:
    /// A filter may change ray.tfar of a hit that passes.
    bool passes_filters(const CommittedMesh& mesh, RTCRay& ray, RTCHit& hit) const {
        const Geometry& geometry = *mesh.geometry;
        const RTCFilterFunctionN own =
            kind_ == Kind::occlusion ? geometry.occluded_filter : geometry.intersect_filter;
        const bool takes = options_.filters_all || geometry.takes_argument_filter;
        const RTCFilterFunctionN given = takes ? options_.filter : nullptr;
        if (own == nullptr && given == nullptr) return true;
        Context local;
#if MORPHRAY_EMBREE == 3
        rtcInitIntersectContext(&local);
#else
        rtcInitRayQueryContext(&local);
#endif
        Context& context = options_.context == nullptr ? local : *options_.context;
        const Context before = context;
        context.instID[0] = hit.instID[0];
#if MORPHRAY_EMBREE == 4
        context.instPrimID[0] = hit.instPrimID[0];
#endif
        int valid = -1;
        RTCRay seen = mesh.is_instance() ? to_object(ray, mesh.to_object) : ray;
        for (const RTCFilterFunctionN filter : {own, given}) {
            if (filter == nullptr || valid == 0) continue;
            const RTCFilterFunctionNArguments arguments = {.valid = &valid,
                                                           .geometryUserPtr = geometry.user,
                                                           .context = &context,
                                                           .ray = reinterpret_cast<RTCRayN*>(&seen),
                                                           .hit = reinterpret_cast<RTCHitN*>(&hit),
                                                           .N = 1};
            filter(&arguments);
        }
        context = before;
        if (valid != 0) ray.tfar = seen.tfar;
        return valid != 0;
    }
    /// The next hit after the last one with a mesh that the mask lets through. A ray through the
    /// diagonal of a quad hits the quad once.
    morphray::Hit next(const morphray::Ray& traced, const morphray::Hit& last,
                       unsigned int ray_mask) const {
        const bool is_quads = committed_.meshes[last.geom_id].is_quads;
        // Queries with a filter of their own count hits, and so take one at an edge.
        const auto crossing =
            options_.filter == nullptr ? morphray::Crossing::each : morphray::Crossing::once;
        morphray::QueryOptions seen = kCallingThread;
        if (!committed_.masks.empty()) seen.visible = visible_to(ray_mask);
        const morphray::Hit hit = scene().intersect(traced, last, crossing, seen);
        const bool is_other_half = is_quads && last.prim_id % 2 == 0 && hit.t == last.t &&
                                   hit.geom_id == last.geom_id && hit.prim_id == last.prim_id + 1;
        return is_other_half ? scene().intersect(traced, hit, crossing, seen) : hit;
    }
    std::span<const std::uint8_t> visible_to(unsigned int ray_mask) const {
        if (visible_.empty() || ray_mask != visible_mask_) {
            visible_.clear();
            visible_.reserve(committed_.meshes.size());
            for (const CommittedMesh& mesh : committed_.meshes)
                visible_.push_back(mesh.sees(ray_mask) ? 1 : 0);
            visible_mask_ = ray_mask;
        }
        return visible_;
    }

    const Committed& committed_;
    QueryOptions options_;
    Kind kind_;
    bool has_filters_;
    /// The meshes that this mask lets through.
    mutable std::vector<std::uint8_t> visible_;
    mutable unsigned int visible_mask_ = 0;
};

constexpr Query::Kind kClosest = Query::Kind::closest;
constexpr Query::Kind kOcclusion = Query::Kind::occlusion;
constexpr float kOccluded = -std::numeric_limits<float>::infinity();
// Packets of fewer rays are traced one by one.
constexpr std::size_t kFewRays = 4;
constexpr std::size_t kMostInPacket = 16;
// Hits are prefetched this many ahead.
constexpr std::size_t kHitsAhead = 6;
// Rays of a stream that are traced together: an image of 256 x 256. They take up to 4 MB.
constexpr std::size_t kBatch = std::size_t{1} << 16;

/// The members of a ray, of 4 bytes each, and the number of one of them.
constexpr std::size_t kRayMembers = 12;
constexpr std::size_t kTfar = 8;

/// Lane i of a packet of N: member after member, each of N lanes.
struct PacketLane {
    float* ray;
    std::size_t n;

    RTCRay load() const {
        RTCRay lane;
        auto* const members = reinterpret_cast<char*>(&lane);
        for (std::size_t k = 0; k < kRayMembers; ++k) std::memcpy(members + 4 * k, ray + k * n, 4);
        return lane;
    }
    void store_tfar(float tfar) const { ray[kTfar * n] = tfar; }
    void store_hit(const RTCHit& hit) const {
        const auto* const members = reinterpret_cast<const char*>(&hit);
        for (std::size_t k = 0; k < kHitMembers; ++k)
            std::memcpy(ray + (kRayMembers + k) * n, members + 4 * k, 4);
    }
    void set_hit(const Query& query, const morphray::Hit& found) const {
        RTCHit hit;
        query.set_hit(found, hit);
        store_hit(hit);
    }
};

/// A ray, with a hit in queries for hits.
struct OneLane {
    RTCRay* ray;

    const RTCRay& load() const { return *ray; }
    void store_tfar(float tfar) const { ray->tfar = tfar; }
    void store_hit(const RTCHit& hit) const { copy_hit(this->hit(), hit); }
    void set_hit(const Query& query, const morphray::Hit& found) const {
        query.set_hit(found, hit());
    }
    RTCHit& hit() const { return reinterpret_cast<RTCRayHit*>(ray)->hit; }
};

template <Query::Kind kind, class Lane>
void store(const Query& query, const morphray::Hit& found, const Lane& lane) {
    lane.store_tfar(kind == kOcclusion ? kOccluded : found.t);
    if (kind == kClosest) lane.set_hit(query, found);
}

/// Stores the first hit that is let through, if there is one: this one or one after it.
template <Query::Kind kind, class Lane>
void store_first(const Query& query, const morphray::Hit& found, const morphray::Ray& traced,
                 const Lane& lane) {
    RTCRay ray = lane.load();
    RTCHit hit;
    if (!query.settle(found, traced, ray, hit)) return;
    lane.store_tfar(kind == kOcclusion ? kOccluded : ray.tfar);
    if (kind == kClosest) lane.store_hit(hit);
}

/// Rays that are traced together, in memory of the thread: fresh memory takes longer than the rays.
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
        // The last one: its size tells that all have grown.
        active.resize(count);
    }
};

/// A batch of few rays on the stack, not initialized.
struct PacketBatch {
    PacketBatch() {}

    std::array<std::uint32_t, kMostInPacket> active;
    union {
        std::array<morphray::Ray, kMostInPacket> rays;
    };
    union {
        std::array<morphray::Hit, kMostInPacket> hits;
        std::array<std::uint8_t, kMostInPacket> occluded;
    };
};

template <Query::Kind kind, class Lane>
void trace_lane(const Query& query, const Lane& lane) {
    const RTCRay& ray = lane.load();
    const morphray::Ray traced = query.to_trace(ray);
    const bool takes_any_hit = query.takes_any_hit(ray.mask);
    if (kind == kOcclusion && takes_any_hit) {
        if (query.scene().occluded(traced)) lane.store_tfar(kOccluded);
    } else if (const morphray::Hit found = query.scene().intersect(traced)) {
        if (takes_any_hit)
            store<kind>(query, found, lane);
        else
            store_first<kind>(query, found, traced, lane);
    }
}

/// Traces the rays lane_of(i) in [begin, end) with valid[i] == -1, or all if valid is null.
template <Query::Kind kind, class LaneOf, class AnyBatch>
void trace_range(const Query& query, LaneOf lane_of, std::size_t begin, std::size_t end,
                 const int* valid, AnyBatch& batch) {
    std::size_t count = 0;
    for (std::size_t i = begin; i < end; ++i)
        if (valid == nullptr || valid[i] == -1)
            batch.active[count++] = static_cast<std::uint32_t>(i);
    if (count < kFewRays) {
        for (std::size_t k = 0; k < count; ++k) trace_lane<kind>(query, lane_of(batch.active[k]));
        return;
    }
    const auto traced = std::span(batch.rays).first(count);
    bool takes_any_hit = true;
    for (std::size_t k = 0; k < count; ++k) {
        const RTCRay& ray = lane_of(batch.active[k]).load();
        traced[k] = query.to_trace(ray);
        takes_any_hit = takes_any_hit && query.takes_any_hit(ray.mask);
    }
    if (kind == kOcclusion && takes_any_hit) {
        const auto occluded = std::span(batch.occluded).first(count);
        query.scene().occluded(traced, occluded, kCallingThread);
        for (std::size_t k = 0; k < count; ++k)
            if (occluded[k] != 0) lane_of(batch.active[k]).store_tfar(kOccluded);
        return;
    }
    const auto found = std::span(batch.hits).first(count);
    query.scene().intersect(traced, found, kCallingThread);
    for (std::size_t k = 0; k < count; ++k) {
        query.prefetch(found[std::min(k + kHitsAhead, count - 1)]);
        if (!found[k]) continue;
        const auto lane = lane_of(batch.active[k]);
        if (takes_any_hit)
            store<kind>(query, found[k], lane);
        else
            store_first<kind>(query, found[k], traced[k], lane);
    }
}

/// Calls `work(query)` if the scene has triangles.
template <Query::Kind kind, class Arguments, class Work>
void ask(const char* call, RTCScene scene, const Arguments* arguments, const void* rays,
         Work work) noexcept {
    with<SceneObject>(call, scene, [&](const SceneObject& s) {
        if (rays == nullptr) fail_argument("the rays are null");
        const Query query(s.committed(), options_of(arguments), kind);
        if (query.committed().scene) work(query);
    });
}

template <Query::Kind kind, class Arguments>
void trace_one(const char* call, RTCScene scene, const Arguments* arguments, void* ray) noexcept {
    ask<kind>(call, scene, arguments, ray, [&](const Query& query) {
        trace_lane<kind>(query, OneLane{static_cast<RTCRay*>(ray)});
    });
}

/// Traces `count` rays lane_of(i), those of them with valid[i] == -1 if it is given.
template <Query::Kind kind, class Arguments, class LaneOf>
void trace(const char* call, RTCScene scene, const Arguments* arguments, const void* rays,
           LaneOf lane_of, std::size_t count, const int* valid = nullptr) noexcept {
    ask<kind>(call, scene, arguments, rays, [&](const Query& query) {
        if (count <= kMostInPacket) {
            PacketBatch batch;
            trace_range<kind>(query, lane_of, 0, count, valid, batch);
            return;
        }
        thread_local Batch kept;
        // A filter may trace other rays.
        Batch batch = std::exchange(kept, {});
        batch.resize(std::min(count, kBatch));
        for (std::size_t begin = 0; begin < count; begin += kBatch)
            trace_range<kind>(query, lane_of, begin, std::min(count, begin + kBatch), valid, batch);
        kept = std::move(batch);
    });
}

template <Query::Kind kind, class Arguments>
void trace_packet(const char* call, const int* valid, RTCScene scene, const Arguments* arguments,
                  void* rays, std::size_t n) noexcept {
    if (valid == nullptr) rays = nullptr;
    const auto lane_of = [=](std::size_t i) {
        return PacketLane{static_cast<float*>(rays) + i, n};
    };
    trace<kind>(call, scene, arguments, rays, lane_of, n, valid);
}

#if MORPHRAY_EMBREE == 3
/// Rays `stride` bytes apart.
auto lanes_apart(void* first, std::size_t stride) {
    return [=](std::size_t i) {
        return OneLane{reinterpret_cast<RTCRay*>(static_cast<char*>(first) + i * stride)};
    };
}
template <class RayType>
auto lanes_at(RayType* const* rays) {
    return [=](std::size_t i) { return OneLane{reinterpret_cast<RTCRay*>(rays[i])}; };
}
#endif

}  // namespace
}  // namespace mray::embree

using namespace mray::embree;

#if MORPHRAY_EMBREE == 3
using IntersectArguments = RTCIntersectContext;
using OccludedArguments = RTCIntersectContext;
#define MORPHRAY_ORDER(arguments, rays) arguments, rays
#else
using IntersectArguments = RTCIntersectArguments;
using OccludedArguments = RTCOccludedArguments;
#define MORPHRAY_ORDER(arguments, rays) rays, arguments
#endif

void rtcIntersect1(RTCScene scene, MORPHRAY_ORDER(IntersectArguments* arguments, RTCRayHit* ray)) {
    trace_one<kClosest>(__func__, scene, arguments, ray);
}
void rtcOccluded1(RTCScene scene, MORPHRAY_ORDER(OccludedArguments* arguments, RTCRay* ray)) {
    trace_one<kOcclusion>(__func__, scene, arguments, ray);
}

#define MORPHRAY_PACKET(n)                                                                    \
    void rtcIntersect##n(const int* valid, RTCScene scene,                                    \
                         MORPHRAY_ORDER(IntersectArguments* arguments, RTCRayHit##n* rays)) { \
        trace_packet<kClosest>(__func__, valid, scene, arguments, rays, n);                   \
    }                                                                                         \
    void rtcOccluded##n(const int* valid, RTCScene scene,                                     \
                        MORPHRAY_ORDER(OccludedArguments* arguments, RTCRay##n* rays)) {      \
        trace_packet<kOcclusion>(__func__, valid, scene, arguments, rays, n);                 \
    }
MORPHRAY_PACKET(4)
MORPHRAY_PACKET(8)
MORPHRAY_PACKET(16)

#if MORPHRAY_EMBREE == 3
void rtcIntersect1M(RTCScene scene, RTCIntersectContext* context, RTCRayHit* rays, unsigned int m,
                    size_t stride) {
    trace<kClosest>(__func__, scene, context, rays, lanes_apart(rays, stride), m);
}
void rtcOccluded1M(RTCScene scene, RTCIntersectContext* context, RTCRay* rays, unsigned int m,
                   size_t stride) {
    trace<kOcclusion>(__func__, scene, context, rays, lanes_apart(rays, stride), m);
}
void rtcIntersect1Mp(RTCScene scene, RTCIntersectContext* context, RTCRayHit** rays,
                     unsigned int m) {
    trace<kClosest>(__func__, scene, context, rays, lanes_at(rays), m);
}
void rtcOccluded1Mp(RTCScene scene, RTCIntersectContext* context, RTCRay** rays, unsigned int m) {
    trace<kOcclusion>(__func__, scene, context, rays, lanes_at(rays), m);
}
#endif
