#include "cpu/reference/brute_tracer.h"

#include "cpu/reference/closest_hit.h"

namespace mray::cpu {

Hit BruteTracer::intersect(const Ray& ray) const {
    ClosestHit closest(ray);
    std::uint32_t prim_id = 0;
    for (const uvec3& t : topology_->triangles) {
        closest.test(positions_[t.x], positions_[t.y], positions_[t.z], prim_id++);
    }
    return closest.hit();
}

bool BruteTracer::occluded(const Ray& ray) const {
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    for (const uvec3& t : topology_->triangles) {
        if (hits_triangle(sheared, ray, positions_[t.x], positions_[t.y], positions_[t.z]))
            return true;
    }
    return false;
}

}  // namespace mray::cpu
