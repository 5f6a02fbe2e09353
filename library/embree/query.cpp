#include "library/embree/query.h"

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

void Query::call_filter(RTCFilterFunctionN filter, const Part& part, int& valid, RTCRay& ray,
                        RTCHit& hit, Context& context) const {
    if (filter == nullptr || valid == 0) return;
    RTCFilterFunctionNArguments arguments;
    arguments.valid = &valid;
    arguments.geometryUserPtr = part.mesh->user;
    arguments.context = &context;
    arguments.ray = reinterpret_cast<RTCRayN*>(&ray);
    arguments.hit = reinterpret_cast<RTCHitN*>(&hit);
    arguments.N = 1;
    filter(&arguments);
}

/// Sets ray.tfar to the hit's t before; if the hit does not pass, the ray is as it was.
bool Query::passes_filters(const Part& part, RTCRay& ray, RTCHit& hit) const {
    const Geometry& mesh = *part.mesh;
    const RTCFilterFunctionN own =
        kind_ == Kind::occlusion ? mesh.occluded_filter : mesh.intersect_filter;
    const bool takes = options_.filters_all || mesh.takes_argument_filter;
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
    RTCRay seen = part.is_instance() ? to_object(ray, part.to_object) : ray;
    call_filter(own, part, valid, seen, hit, context);
    call_filter(given, part, valid, seen, hit, context);
    context.instID[0] = before.instID[0];
#if MORPHRAY_EMBREE == 4
    context.instPrimID[0] = before.instPrimID[0];
#endif
    if (valid != 0) ray.tfar = seen.tfar;
    return valid != 0;
}

/// The next hit after the last one. A ray through the diagonal of a quad hits the quad once.
morphray::Hit Query::next(const morphray::Ray& traced, const Part& part,
                          const morphray::Hit& last) const {
    const morphray::Hit hit = scene().intersect(traced, last, crossing_);
    const bool is_other_half = part.is_quads && last.prim_id % 2 == 0 && hit.t == last.t &&
                               hit.geom_id == last.geom_id && hit.prim_id == last.prim_id + 1;
    return is_other_half ? scene().intersect(traced, hit, crossing_) : hit;
}

bool Query::settle(morphray::Hit found, const morphray::Ray& traced, RTCRay& ray,
                   RTCHit& hit) const {
    while (found) {
        const Part& part = committed_.parts[found.geom_id];
        if (!committed_.uses_masks || part.sees(ray.mask)) {
            RTCHit candidate;
            set_hit(found, candidate);
            const float tfar = ray.tfar;
            ray.tfar = found.t;
            if (passes_filters(part, ray, candidate)) {
                copy_hit(hit, candidate);
                return true;
            }
            ray.tfar = tfar;
        }
        found = next(traced, part, found);
    }
    return false;
}

}  // namespace mray::embree
