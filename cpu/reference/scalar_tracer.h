// The reference of all faster tracers, in portable C++: single rays over the shared layout, and
// without a tree.
#pragma once

#include <cassert>
#include <cstdint>
#include <span>

#include "common/bvh/bvh.h"
#include "common/interop/hit_rule.h"
#include "common/interop/slab.h"
#include "common/scene/mesh.h"
#include "common/scene_queries.h"

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
    float tnear_, tfar_, t_;
    Hit hit_ = no_hit();
};

inline bool hits_triangle(const ShearedRay& sheared, const Ray& ray, vec3 a, vec3 b, vec3 c) {
    TriangleHit hit;
    return may_hit_triangle(sheared, a, b, c) &&
           intersect_triangle(sheared, ray.tnear, ray.tfar, a, b, c, hit);
}

/// Calls visit_leaf(leaf) for the leaves whose boxes, and the boxes of the nodes above, a ray meets
/// with a least depth of `last` or less, the nearest first. It returns the next `last`, less than 0
/// to stop.
template <class VisitLeaf>
void for_each_near_leaf(const Bvh& bvh, const Ray& ray, float last, VisitLeaf visit_leaf) {
    struct Entry {
        float t_least;
        std::uint32_t child;
    };
    const SlabRay slab = slab_ray(ray.org, ray.dir);
    TraversalStack<Entry> stack;
    stack[0] = {0, 0};
    std::uint32_t size = 1;
    while (size > 0) {
        const Entry entry = stack[--size];
        if (entry.t_least > last) continue;
        if (is_leaf(entry.child)) {
            last = visit_leaf(bvh.leaves[leaf_of(entry.child)]);
            continue;
        }
        const Node& node = bvh.nodes[entry.child];
        const std::uint32_t base = size;
        for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
            const Box box = slot_box(node, slot);
            float t_least;
            if (!hits_box(slab, box.lower, box.upper, t_least) || t_least > last) return;
            assert(size < std::size(stack));
            std::uint32_t place = size++;
            for (; place > base && stack[place - 1].t_least < t_least; --place)
                stack[place] = stack[place - 1];
            stack[place] = {t_least, child};
        });
    }
}

template <class Visit>
void for_each_triangle(const Leaf& leaf, Visit visit) {
    const auto position = [&leaf](std::uint32_t local, uint k) {
        const LeafVertex& v = leaf.vertex[corner(local, k)];
        return vec3(v.x, v.y, v.z);
    };
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t local = leaf.vertex[i].corners;
        visit(position(local, 0), position(local, 1), position(local, 2), leaf.prim_id[i]);
    }
}

/// Finds closest and any hits over a tree that outlives it. Threads may share one.
class ScalarTracer {
public:
    explicit ScalarTracer(const Bvh& bvh) : bvh_(&bvh) {}

    Hit intersect(const Ray& ray) const {
        ClosestHit closest(ray);
        for_each_near_leaf(*bvh_, ray, last_depth(ray.tfar), [&](const Leaf& leaf) {
            for_each_triangle(leaf, [&](auto... triangle) { closest.test(triangle...); });
            return last_depth(closest.t());
        });
        return closest.hit();
    }

    bool occluded(const Ray& ray) const {
        const ShearedRay sheared = shear_ray(ray.org, ray.dir);
        const float last = last_depth(ray.tfar);
        bool found = false;
        for_each_near_leaf(*bvh_, ray, last, [&](const Leaf& leaf) {
            for_each_triangle(leaf, [&](vec3 a, vec3 b, vec3 c, std::uint32_t) {
                found = found || hits_triangle(sheared, ray, a, b, c);
            });
            return found ? -1.0f : last;
        });
        return found;
    }

private:
    const Bvh* bvh_;
};

/// Tests every ray against every triangle of a mesh in scene space that outlives it, and answers
/// queries. Threads may share one.
class BruteTracer {
public:
    BruteTracer(const Topology& topology, std::span<const vec3> positions)
        : topology_(&topology), positions_(positions) {}

    Hit intersect(const Ray& ray) const;
    bool occluded(const Ray& ray) const;
    void operator()(const QueryBatch& batch) const;

private:
    const Topology* topology_;
    std::span<const vec3> positions_;
};

}  // namespace mray::cpu
