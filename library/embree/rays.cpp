#include "library/embree/rays.h"

namespace mray::embree {
namespace {

/// The ray in the space of an instanced mesh.
RTCRay to_object(const RTCRay& ray, const Transform& transform) {
    RTCRay mapped = ray;
    const morphray::Vec3 org = transform.point({ray.org_x, ray.org_y, ray.org_z});
    const morphray::Vec3 dir = transform.vector({ray.dir_x, ray.dir_y, ray.dir_z});
    mapped.org_x = org.x;
    mapped.org_y = org.y;
    mapped.org_z = org.z;
    mapped.dir_x = dir.x;
    mapped.dir_y = dir.y;
    mapped.dir_z = dir.z;
    return mapped;
}

Context no_context() {
    Context context;
#if MORPHRAY_EMBREE == 3
    rtcInitIntersectContext(&context);
#else
    rtcInitRayQueryContext(&context);
#endif
    return context;
}

}  // namespace

void Query::call_filter(RTCFilterFunctionN filter, const CommittedMesh& mesh, int& valid,
                        RTCRay& ray, RTCHit& hit, Context& context) const {
    if (filter == nullptr || valid == 0) return;
    RTCFilterFunctionNArguments arguments;
    arguments.valid = &valid;
    arguments.geometryUserPtr = mesh.geometry->user;
    arguments.context = &context;
    arguments.ray = reinterpret_cast<RTCRayN*>(&ray);
    arguments.hit = reinterpret_cast<RTCHitN*>(&hit);
    arguments.N = 1;
    filter(&arguments);
}

/// Sets ray.tfar to the hit's t before; if the hit does not pass, the ray is as it was.
bool Query::passes_filters(const CommittedMesh& mesh, RTCRay& ray, RTCHit& hit) const {
    const Geometry& geometry = *mesh.geometry;
    const RTCFilterFunctionN own =
        kind_ == Kind::occlusion ? geometry.occluded_filter : geometry.intersect_filter;
    const bool takes = options_.filters_all || geometry.takes_argument_filter;
    const RTCFilterFunctionN given = takes ? options_.filter : nullptr;
    if (own == nullptr && given == nullptr) return true;
    Context local = no_context();
    Context& context = options_.context == nullptr ? local : *options_.context;
    const Context before = context;
    context.instID[0] = hit.instID[0];
#if MORPHRAY_EMBREE == 4
    context.instPrimID[0] = hit.instPrimID[0];
#endif
    int valid = -1;
    RTCRay seen = mesh.is_instance() ? to_object(ray, mesh.to_object) : ray;
    call_filter(own, mesh, valid, seen, hit, context);
    call_filter(given, mesh, valid, seen, hit, context);
    context.instID[0] = before.instID[0];
#if MORPHRAY_EMBREE == 4
    context.instPrimID[0] = before.instPrimID[0];
#endif
    if (valid != 0) ray.tfar = seen.tfar;
    return valid != 0;
}

/// The next hit after the last one. A ray through the diagonal of a quad hits the quad once.
morphray::Hit Query::next(const morphray::Ray& traced, const CommittedMesh& mesh,
                          const morphray::Hit& last) const {
    const morphray::Hit hit = scene().intersect(traced, last, crossing_);
    const bool is_other_half = mesh.is_quads && last.prim_id % 2 == 0 && hit.t == last.t &&
                               hit.geom_id == last.geom_id && hit.prim_id == last.prim_id + 1;
    return is_other_half ? scene().intersect(traced, hit, crossing_) : hit;
}

bool Query::settle(morphray::Hit found, const morphray::Ray& traced, RTCRay& ray,
                   RTCHit& hit) const {
    while (found) {
        const CommittedMesh& mesh = committed_.meshes[found.geom_id];
        if (!committed_.uses_masks || mesh.sees(ray.mask)) {
            RTCHit candidate;
            set_hit(found, candidate);
            const float tfar = ray.tfar;
            ray.tfar = found.t;
            if (passes_filters(mesh, ray, candidate)) {
                copy_hit(hit, candidate);
                return true;
            }
            ray.tfar = tfar;
        }
        found = next(traced, mesh, found);
    }
    return false;
}

namespace {

constexpr Query::Kind kClosest = Query::Kind::closest;
constexpr Query::Kind kOcclusion = Query::Kind::occlusion;
constexpr float kOccluded = -std::numeric_limits<float>::infinity();
// Packets of fewer rays are traced one by one.
constexpr std::size_t kFewRays = 4;
// Rays of a stream that are traced together: an image of 256 x 256.
constexpr std::size_t kBatch = std::size_t{1} << 16;
constexpr morphray::QueryOptions kCallingThread = {.threads = morphray::Threads::calling};

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
};

/// A ray, with a hit if it is asked for hits.
struct OneLane {
    RTCRay* ray;

    const RTCRay& load() const { return *ray; }
    void store_tfar(float tfar) const { ray->tfar = tfar; }
    void store_hit(const RTCHit& hit) const { copy_hit(this->hit(), hit); }
    RTCHit& hit() const { return reinterpret_cast<RTCRayHit*>(ray)->hit; }
};

struct Packet {
    float* first;
    std::size_t n;

    PacketLane operator[](std::size_t i) const { return {first + i, n}; }
};

#if MORPHRAY_EMBREE == 3

/// Rays `stride` bytes apart.
struct Stream {
    char* first;
    std::size_t stride;

    OneLane operator[](std::size_t i) const {
        return {reinterpret_cast<RTCRay*>(first + i * stride)};
    }
};

struct Pointers {
    void* const* rays;

    OneLane operator[](std::size_t i) const { return {static_cast<RTCRay*>(rays[i])}; }
};

#endif

template <Query::Kind kind, class Lane>
void store(const Query& query, const morphray::Hit& found, const Lane& lane) {
    if constexpr (kind == kOcclusion) {
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
    if constexpr (kind == kOcclusion) {
        lane.store_tfar(kOccluded);
    } else {
        lane.store_tfar(ray.tfar);
        lane.store_hit(hit);
    }
}

/// The memory, up to 4 MB, stays with the thread: fresh memory takes longer than the rays.
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
    if (kind == kOcclusion && takes_any_hit) {
        const auto occluded = std::span(mine.occluded).first(count);
        query.scene().occluded(traced, occluded, kCallingThread);
        for (std::size_t k = 0; k < count; ++k)
            if (occluded[k] != 0) rays[mine.active[k]].store_tfar(kOccluded);
    } else {
        const auto found = std::span(mine.hits).first(count);
        query.scene().intersect(traced, found, kCallingThread);
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

template <Query::Kind kind, class Lane>
void trace_lane(const Query& query, const Lane& lane) {
    const RTCRay& ray = lane.load();
    const morphray::Ray traced = query.to_trace(ray);
    if (kind == kOcclusion && query.takes_any_hit(ray.mask)) {
        if (query.scene().occluded(traced)) lane.store_tfar(kOccluded);
    } else if (const morphray::Hit found = query.scene().intersect(traced)) {
        store_first<kind>(query, found, traced, lane);
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

/// Traces `count` rays, those of them with valid[i] == -1 if it is given.
template <Query::Kind kind, class Arguments, class Layout>
void trace(const char* call, RTCScene scene, const Arguments* arguments, const void* first,
           const Layout& rays, std::size_t count, const int* valid = nullptr) noexcept {
    ask<kind>(call, scene, arguments, first, [&](const Query& query) {
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

template <Query::Kind kind, class Arguments>
void trace_packet(const char* call, const int* valid, RTCScene scene, const Arguments* arguments,
                  void* rays, std::size_t n) noexcept {
    if (valid == nullptr) rays = nullptr;
    trace<kind>(call, scene, arguments, rays, Packet{static_cast<float*>(rays), n}, n, valid);
}

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
    trace<kClosest>(__func__, scene, context, rays, Stream{reinterpret_cast<char*>(rays), stride},
                    m);
}
void rtcOccluded1M(RTCScene scene, RTCIntersectContext* context, RTCRay* rays, unsigned int m,
                   size_t stride) {
    trace<kOcclusion>(__func__, scene, context, rays, Stream{reinterpret_cast<char*>(rays), stride},
                      m);
}
void rtcIntersect1Mp(RTCScene scene, RTCIntersectContext* context, RTCRayHit** rays,
                     unsigned int m) {
    trace<kClosest>(__func__, scene, context, rays, Pointers{reinterpret_cast<void**>(rays)}, m);
}
void rtcOccluded1Mp(RTCScene scene, RTCIntersectContext* context, RTCRay** rays, unsigned int m) {
    trace<kOcclusion>(__func__, scene, context, rays, Pointers{reinterpret_cast<void**>(rays)}, m);
}

#endif
