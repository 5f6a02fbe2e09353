// Rays of Embree's layout, and the hits that masks and filters let through.
#pragma once

#include <bit>
#include <cstring>

#include "library/embree/scene.h"
#include "morphray/geometry.hpp"

namespace mray::embree {

/// The members of a hit, of 4 bytes each. Behind them version 4 has bytes that are the caller's.
inline constexpr std::size_t kHitMembers = MORPHRAY_EMBREE == 3 ? 8 : 9;
inline void copy_hit(RTCHit& to, const RTCHit& from) { std::memcpy(&to, &from, 4 * kHitMembers); }

struct QueryOptions {
    /// The context may be null.
    Context* context = nullptr;
    /// The filter of context or arguments is null if there is none.
    RTCFilterFunctionN filter = nullptr;
    /// It is also called for geometries that have not asked for it.
    bool filters_all = false;
};

#if MORPHRAY_EMBREE == 3
inline QueryOptions options_of(const Context* context) {
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

/// Intervals are closed in robust scenes and in the library, and open at tnear in others.
inline float least_t(float tnear, bool is_robust) {
    if (is_robust || !(tnear > 0)) return tnear;
    return std::bit_cast<float>(std::bit_cast<std::uint32_t>(tnear) + 1);
}

/// Answers the rays of a call in one thread.
class Query {
public:
    enum class Kind { closest, occlusion };

    Query(const Committed& committed, const QueryOptions& options, Kind kind)
        : committed_(committed),
          options_(options),
          kind_(kind),
          crossing_(options.filter == nullptr ? morphray::Crossing::each
                                              : morphray::Crossing::once),
          has_filters_(
              options.filter != nullptr ||
              (kind == Kind::closest ? committed.filters_hits : committed.filters_occlusion)) {}

    const Committed& committed() const { return committed_; }
    /// The tracer's scene; to be asked only if there is one.
    const morphray::Scene& scene() const { return *committed_.scene; }
    morphray::Ray to_trace(const RTCRay& ray) const {
        return {{ray.org_x, ray.org_y, ray.org_z},
                least_t(ray.tnear, committed_.is_robust),
                {ray.dir_x, ray.dir_y, ray.dir_z},
                ray.tfar};
    }
    /// Returns true if the first hit of a ray with this mask is let through.
    bool takes_any_hit(unsigned int ray_mask) const {
        return !has_filters_ && committed_.all_seen(ray_mask);
    }
    bool has_filters() const { return has_filters_; }
    /// The closest hit with a mesh that the mask lets through; `found` is that of all meshes.
    morphray::Hit seen_hit(morphray::Hit found, const morphray::Ray& traced,
                           unsigned int ray_mask) const {
        while (found && !committed_.meshes[found.geom_id].sees(ray_mask))
            found = next(traced, committed_.meshes[found.geom_id], found);
        return found;
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
    bool settle(morphray::Hit found, const morphray::Ray& traced, RTCRay& ray, RTCHit& hit) const;

private:
    bool passes_filters(const CommittedMesh& mesh, RTCRay& ray, RTCHit& hit) const;
    void call_filter(RTCFilterFunctionN filter, const CommittedMesh& mesh, int& valid, RTCRay& ray,
                     RTCHit& hit, Context& context) const;
    morphray::Hit next(const morphray::Ray& traced, const CommittedMesh& mesh,
                       const morphray::Hit& last) const;
    const Committed& committed_;
    QueryOptions options_;
    Kind kind_;
    /// Queries with a filter of their own count hits, and so take one at an edge.
    morphray::Crossing crossing_;
    bool has_filters_;
};

}  // namespace mray::embree
