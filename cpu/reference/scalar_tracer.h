// Single rays over the shared layout, in portable C++: the reference for tests of all faster
// tracers.
#pragma once

#include <cstdint>

#include "common/bvh/bvh.h"
#include "common/interop/hit_rule.h"
#include "common/interop/ray.h"

namespace mray::cpu {

/// The closest hit of a ray over any sequence of triangles.
class ClosestHit {
public:
    explicit ClosestHit(const Ray& ray)
        : sheared_(shear_ray(ray.org, ray.dir)), tnear_(ray.tnear), tfar_(ray.tfar), t_(ray.tfar) {}

    void test(vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
        TriangleHit hit;
        if (may_hit_triangle(sheared_, a, b, c) &&
            intersect_triangle(sheared_, tnear_, tfar_, a, b, c, hit) &&
            is_closer(hit.t, prim_id, t_, hit_.prim_id)) {
            t_ = hit.t;
            hit_ = make_hit(hit, prim_id);
        }
    }

    /// A box entered later than this holds no closer hit.
    float t() const { return t_; }
    Hit hit() const { return hit_; }

private:
    ShearedRay sheared_;
    float tnear_;
    float tfar_;
    float t_;
    Hit hit_ = no_hit();
};

/// Whether the ray hits this triangle.
inline bool hits_triangle(const ShearedRay& sheared, const Ray& ray, vec3 a, vec3 b, vec3 c) {
    TriangleHit hit;
    return may_hit_triangle(sheared, a, b, c) &&
           intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit);
}

/// Finds closest and any hits over a tree that outlives it. Threads may share one.
class ScalarTracer {
public:
    explicit ScalarTracer(const Bvh& bvh) : bvh_(&bvh) {}

    Hit intersect(const Ray& ray) const;
    bool occluded(const Ray& ray) const;

private:
    const Bvh* bvh_;
};

}  // namespace mray::cpu
