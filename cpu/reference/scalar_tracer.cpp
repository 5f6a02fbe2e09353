#include "cpu/reference/scalar_tracer.h"

#include <cassert>

#include "common/interop/bvh_layout.h"

namespace mray::cpu {
namespace {

struct Entry {
    float t_least;
    std::uint32_t child;
};

/// Children still to visit, nearest on top. The size is bounded because the builder bounds the
/// depth.
class Stack {
public:
    Stack() { entries_[0] = {0, 0}; }

    bool empty() const { return size_ == 0; }
    Entry pop() { return entries_[--size_]; }

    /// Pushes the children of a node that the ray meets with a least depth of `last` or less,
    /// sorted so that the nearest is popped first.
    void push_children(const Node& node, const SlabRay& slab, float last) {
        const std::uint32_t base = size_;
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            const vec3 lower = {node.lower_x[slot], node.lower_y[slot], node.lower_z[slot]};
            const vec3 upper = {node.upper_x[slot], node.upper_y[slot], node.upper_z[slot]};
            float t_least;
            if (!hits_box(slab, lower, upper, t_least) || t_least > last) continue;
            assert(size_ < kMaxStack);
            std::uint32_t place = size_++;
            for (; place > base && entries_[place - 1].t_least < t_least; --place) {
                entries_[place] = entries_[place - 1];
            }
            entries_[place] = {t_least, node.child[slot]};
        }
    }

private:
    std::uint32_t size_ = 1;
    Entry entries_[kMaxStack];
};

vec3 position(const LeafVertex& v) { return {v.x, v.y, v.z}; }

/// Calls visit(a, b, c, prim_id) for each triangle of a leaf until it returns false.
template <class Visit>
void for_each_triangle(const Leaf& leaf, Visit visit) {
    const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t local = leaf.vertex[i].corners;
        if (!visit(position(leaf.vertex[corner(local, 0)]), position(leaf.vertex[corner(local, 1)]),
                   position(leaf.vertex[corner(local, 2)]), leaf.prim_id[i])) {
            return;
        }
    }
}

}  // namespace

Hit ScalarTracer::intersect(const Ray& ray) const {
    const SlabRay slab = slab_ray(ray.org, ray.dir);
    ClosestHit closest(ray);
    Stack stack;
    while (!stack.empty()) {
        const Entry entry = stack.pop();
        const float last = last_depth(closest.t());
        if (entry.t_least > last) continue;
        if ((entry.child & kLeafBit) == 0) {
            stack.push_children(bvh_->nodes[entry.child], slab, last);
            continue;
        }
        for_each_triangle(bvh_->leaves[entry.child & ~kLeafBit],
                          [&](vec3 a, vec3 b, vec3 c, std::uint32_t prim_id) {
                              closest.test(a, b, c, prim_id);
                              return true;
                          });
    }
    return closest.hit();
}

bool ScalarTracer::occluded(const Ray& ray) const {
    const SlabRay slab = slab_ray(ray.org, ray.dir);
    const ShearedRay sheared = shear_ray(ray.org, ray.dir);
    const float last = last_depth(ray.tfar);
    Stack stack;
    while (!stack.empty()) {
        const Entry entry = stack.pop();
        if ((entry.child & kLeafBit) == 0) {
            stack.push_children(bvh_->nodes[entry.child], slab, last);
            continue;
        }
        bool found = false;
        for_each_triangle(bvh_->leaves[entry.child & ~kLeafBit],
                          [&](vec3 a, vec3 b, vec3 c, std::uint32_t) {
                              found = hits_triangle(sheared, ray, a, b, c);
                              return !found;
                          });
        if (found) return true;
    }
    return false;
}

}  // namespace mray::cpu
