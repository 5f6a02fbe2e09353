#include "lab/methods/rules.h"

#include <array>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>

#include "cpu/reference/scalar_tracer.h"

namespace mray::lab {
namespace {

using glm::cross;
using glm::dot;

/// True if no two values have opposite signs and not all are 0.
bool alike(float u, float v, float w) {
    return !((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) &&
           (u != 0 || v != 0 || w != 0);
}

struct MoellerTrumbore {
    const Ray& ray;

    bool intersect(vec3 a, vec3 b, vec3 c, float& t, float& u, float& v) const {
        const vec3 e1 = b - a;
        const vec3 e2 = c - a;
        const vec3 p = cross(ray.dir, e2);
        const float determinant = dot(e1, p);
        if (!(determinant != 0)) return false;
        const float inverse = 1 / determinant;
        const vec3 s = ray.org - a;
        u = dot(s, p) * inverse;
        if (!(u >= 0 && u <= 1)) return false;
        const vec3 q = cross(s, e1);
        v = dot(ray.dir, q) * inverse;
        if (!(v >= 0 && u + v <= 1)) return false;
        t = dot(e2, q) * inverse;
        return t > 0;
    }
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

/// The usual slab test, far ends enlarged by 2 ulp (T. Ize. Robust BVH ray traversal. JCGT 2013).
class PaddedSlabs {
public:
    explicit PaddedSlabs(const Ray& ray)
        : org_{ray.org.x, ray.org.y, ray.org.z},
          rdir_{1 / ray.dir.x, 1 / ray.dir.y, 1 / ray.dir.z} {}

    bool meets(const Node& node, std::uint32_t slot, float& t_enter) const {
        constexpr float kPad = 1.00000024f;
        const std::array<const float*, 3> lower{node.lower_x, node.lower_y, node.lower_z};
        const std::array<const float*, 3> upper{node.upper_x, node.upper_y, node.upper_z};
        float enter = 0;
        float leave = std::numeric_limits<float>::infinity();
        for (std::size_t axis = 0; axis < 3; ++axis) {
            float t0 = (lower[axis][slot] - org_[axis]) * rdir_[axis];
            float t1 = (upper[axis][slot] - org_[axis]) * rdir_[axis];
            if (rdir_[axis] < 0) std::swap(t0, t1);
            // A NaN (0 times infinity: the ray runs in the plane) has no effect.
            enter = t0 > enter ? t0 : enter;
            leave = t1 * kPad < leave ? t1 * kPad : leave;
        }
        t_enter = enter;
        return enter <= leave;
    }

private:
    std::array<float, 3> org_;
    std::array<float, 3> rdir_;
};

/// Returns the nearest hit, of equal ones that with the smaller prim_id. rule.intersect(a, b, c, t,
/// u, v) returns true with t in (0, infinity).
template <class Rule>
Hit trace_plainly(const Bvh& bvh, const Ray& ray) {
    struct Entry {
        float t_enter;
        std::uint32_t child;
    };
    const Rule rule{ray};
    const PaddedSlabs slabs(ray);
    Hit best = no_hit();
    float best_t = ray.tfar;
    std::array<Entry, kMaxStack> stack;
    std::size_t size = 0;
    stack[size++] = {0, 0};
    while (size != 0) {
        const Entry entry = stack[--size];
        if (entry.t_enter > best_t) continue;
        if ((entry.child & kLeafBit) == 0) {
            const Node& node = bvh.nodes[entry.child];
            const std::size_t base = size;
            for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
                float t_enter;
                if (!slabs.meets(node, slot, t_enter) || t_enter > best_t) continue;
                std::size_t place = size++;
                for (; place > base && stack[place - 1].t_enter < t_enter; --place)
                    stack[place] = stack[place - 1];
                stack[place] = {t_enter, node.child[slot]};
            }
            continue;
        }
        cpu::for_each_triangle(bvh.leaves[entry.child & ~kLeafBit], [&](vec3 a, vec3 b, vec3 c,
                                                                        std::uint32_t prim_id) {
            float t, u, v;
            if (!rule.intersect(a, b, c, t, u, v)) return;
            if (t < ray.tnear || t > best_t || (t == best_t && prim_id > best.prim_id)) return;
            best_t = t;
            best = {t, u, v, prim_id};
        });
    }
    return best;
}

template <class Rule>
void trace_batch(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = trace_plainly<Rule>(bvh, rays[i]);
}

}  // namespace

void trace_by_moeller_trumbore(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    trace_batch<MoellerTrumbore>(bvh, rays, hits);
}

void trace_by_woop(const Bvh& bvh, std::span<const Ray> rays, std::span<Hit> hits) {
    trace_batch<WoopWatertight>(bvh, rays, hits);
}

}  // namespace mray::lab
