// Intersection rules from the literature in float, each as its authors give it.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>

#include "common/interop/hit_rule.h"

namespace mray::accuracy {

using glm::cross;
using glm::dot;

/// Whether no two values have opposite signs and not all are 0.
inline bool alike(float u, float v, float w) {
    return !((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) &&
           (u != 0 || v != 0 || w != 0);
}

class MoellerTrumbore {
public:
    explicit MoellerTrumbore(const Ray& ray) : org_(ray.org), dir_(ray.dir) {}

    bool intersect(vec3 a, vec3 b, vec3 c, float& t, float& u, float& v) const {
        const vec3 e1 = b - a;
        const vec3 e2 = c - a;
        const vec3 p = cross(dir_, e2);
        const float determinant = dot(e1, p);
        if (!(determinant != 0)) return false;
        const float inverse = 1 / determinant;
        const vec3 s = org_ - a;
        u = dot(s, p) * inverse;
        if (!(u >= 0 && u <= 1)) return false;
        const vec3 q = cross(s, e1);
        v = dot(dir_, q) * inverse;
        if (!(v >= 0 && u + v <= 1)) return false;
        t = dot(e2, q) * inverse;
        return t > 0;
    }

private:
    vec3 org_;
    vec3 dir_;
};

/// Falls back to double precision if an edge function is 0, as the paper does.
class WoopWatertight {
public:
    explicit WoopWatertight(const Ray& ray) : org_(ray.org) {
        const vec3 d = ray.dir;
        const vec3 size(std::abs(d.x), std::abs(d.y), std::abs(d.z));
        kz_ = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
        kx_ = (kz_ + 1) % 3;
        ky_ = (kx_ + 1) % 3;
        if (d[kz_] < 0) std::swap(kx_, ky_);
        sx_ = d[kx_] / d[kz_];
        sy_ = d[ky_] / d[kz_];
        sz_ = 1 / d[kz_];
    }

    bool intersect(vec3 va, vec3 vb, vec3 vc, float& t, float& u, float& v) const {
        const vec3 a = va - org_;
        const vec3 b = vb - org_;
        const vec3 c = vc - org_;
        const float ax = a[kx_] - sx_ * a[kz_];
        const float ay = a[ky_] - sy_ * a[kz_];
        const float bx = b[kx_] - sx_ * b[kz_];
        const float by = b[ky_] - sy_ * b[kz_];
        const float cx = c[kx_] - sx_ * c[kz_];
        const float cy = c[ky_] - sy_ * c[kz_];
        float eu = cx * by - cy * bx;
        float ev = ax * cy - ay * cx;
        float ew = bx * ay - by * ax;
        if (eu == 0 || ev == 0 || ew == 0) {
            const auto exact = [](float p, float q, float r, float s) {
                return static_cast<float>(double{p} * q - double{r} * s);
            };
            eu = exact(cx, by, cy, bx);
            ev = exact(ax, cy, ay, cx);
            ew = exact(bx, ay, by, ax);
        }
        if (!alike(eu, ev, ew)) return false;
        const float determinant = eu + ev + ew;
        if (!(determinant != 0)) return false;
        const float scaled = dot(vec3(eu, ev, ew), vec3(sz_ * a[kz_], sz_ * b[kz_], sz_ * c[kz_]));
        const float inverse = 1 / determinant;
        t = scaled * inverse;
        u = ev * inverse;
        v = ew * inverse;
        return t > 0;
    }

private:
    vec3 org_;
    int kx_, ky_, kz_;
    float sx_, sy_, sz_;
};

/// The rule of the program.
class OurRule {
public:
    explicit OurRule(const Ray& ray)
        : sheared_(shear_ray(ray.org, ray.dir)), tnear_(ray.tnear), tfar_(ray.tfar) {}

    bool intersect(vec3 a, vec3 b, vec3 c, float& t, float& u, float& v) const {
        TriangleHit hit;
        if (!may_hit_triangle(sheared_, a, b, c) ||
            !intersect_triangle(sheared_, tnear_, tfar_, a, b, c, hit)) {
            return false;
        }
        t = hit.t;
        u = hit.u;
        v = hit.v;
        return true;
    }

private:
    ShearedRay sheared_;
    float tnear_;
    float tfar_;
};

}  // namespace mray::accuracy
