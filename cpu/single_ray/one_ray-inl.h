// One ray by itself: prepared without vectors, because a vector of one ray takes as long as a full
// one, and traced one node after the other.
#if defined(MORPHRAY_CPU_SINGLE_RAY_ONE_RAY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_ONE_RAY_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_ONE_RAY_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_ONE_RAY_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "cpu/single_ray/closest_leaf-inl.h"
#include "cpu/single_ray/leaf_hit_rule-inl.h"
#include "cpu/single_ray/node_lanes-inl.h"
#include "cpu/single_ray/ray_stream-inl.h"
#include "cpu/single_ray/walks-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// a * b + c as mul_add() rounds it.
HWY_INLINE float mul_add_one(float a, float b, float c) {
#if HWY_NATIVE_FMA
    return __builtin_fmaf(a, b, c);
#else
    return a * b + c;
#endif
}

/// prepare_slab() for ray 0 of a stream.
HWY_INLINE void prepare_slab_of_one(RayStream& stream, std::uint32_t axis, float org, float dir,
                                    float least) {
    const float rdir = dir == 0 ? kHugeReciprocal : 1.0f / dir;
    const float rdir_far = rdir * kStreamRounding;
    const float dilation = (kStreamDilation * std::abs(org) + least) * std::abs(rdir);
    stream.rdir[axis][0] = rdir;
    stream.rdir_far[axis][0] = rdir_far;
    stream.k_near[axis][0] = mul_add_one(org, rdir, dilation);
    stream.k_far[axis][0] = mul_add_one(org, rdir_far, -dilation);
    stream.near_offset[axis][0] = 2 * kPlaneBytes * axis + (rdir < 0 ? kPlaneBytes : 0);
}

/// Sets what closest hits ask of ray 0 of a stream that is alone in it, with the bits of
/// prepare_rays(). Only vectors of rays ask for org, dir and the slopes.
HWY_INLINE void prepare_one(RayStream& stream, const Ray& ray) {
    const float least = mray::least_dilation(ray.org);
    for (std::uint32_t axis = 0; axis < 3; ++axis)
        prepare_slab_of_one(stream, axis, ray.org[axis], ray.dir[axis], least);
    stream.tnear[0] = ray.tnear;
    stream.tfar[0] = ray.tfar;
    stream.least_dilation[0] = least;
    stream.depth_margin[0] = mray::depth_margin(ray.org);
    stream.last_depth[0] = mray::last_depth(ray.tfar);
    // As shear_ray(), but by components: compilers copy its vectors through memory, which took a
    // tenth of a call (lab/notes/cpu_tracer.md).
    const std::uint32_t axis = largest_axis(ray.dir);
    const std::uint32_t axes[3] = {axis == 2 ? 0 : axis + 1, axis == 0 ? 2 : axis - 1, axis};
    for (int k = 0; k < 3; ++k) {
        stream.sheared_org[k][0] = ray.org[axes[k]];
        stream.sheared_dir[k][0] = ray.dir[axes[k]];
    }
    stream.axis[0] = axis;
    stream.depth_slack[0] = 0.25f * stream.depth_margin[0];
    const DepthlessBound<float> bound =
        depthless_bound(most_depth(std::abs(stream.sheared_org[2][0])));
    stream.bound_linear[0] = bound.linear;
    stream.bound_constant[0] = bound.constant;
}

/// prepare_range() for such a ray.
HWY_INLINE void prepare_range_of_one(RayStream& stream, const Ray& ray) {
    const float size = mray::extent_of_rays(ray.org);
    const float margin = kCertainDepth * size;
    const float dz = std::abs(stream.sheared_dir[2][0]);
    stream.certain_from[0] = ray.tnear * dz + margin;
    const float end = std::min(ray.tfar * dz, 4.0f * size);
    const bool is_near = size <= kCertainOrigin;
    stream.certain_to[0] = is_near ? end - margin : -1.0f;
    stream.certain_beyond[0] = is_near ? end + kBeyondDepth * size : kHugeReciprocal;
}

/// The closest hit of a ray whose main axis is kAxis.
template <int kAxis>
HWY_NOINLINE void intersect_ray_along(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                                      ClosestHits& closest) {
    for_each_near_leaf<kAxis>(bvh, stream, ray, closest.last[ray], [&](const Leaf& leaf) HWY_ATTR {
        intersect_leaf_alone<kAxis>(stream, ray, leaf, closest);
    });
}

/// The closest hit of a ray.
HWY_INLINE void intersect_ray(const Bvh& bvh, const RayStream& stream, std::size_t ray,
                              ClosestHits& closest) {
    const std::uint32_t axis = stream.axis[ray];
    if (axis == 0) return intersect_ray_along<0>(bvh, stream, ray, closest);
    if (axis == 1) return intersect_ray_along<1>(bvh, stream, ray, closest);
    intersect_ray_along<2>(bvh, stream, ray, closest);
}

/// The closest hit of a ray by itself.
HWY_NOINLINE inline Hit intersect_one(const Bvh& bvh, const Ray& ray) {
    RayStream stream;
    prepare_one(stream, ray);
    ClosestHits closest;
    closest.t[0] = ray.tfar;
    closest.last[0] = stream.last_depth[0];
    closest.u[0] = closest.v[0] = 0;
    closest.prim_id[0] = kNoPrim;
    intersect_ray(bvh, stream, 0, closest);
    return closest.hit(0);
}

/// Whether it hits anything.
HWY_NOINLINE inline bool occluded_one(const Bvh& bvh, const Ray& ray) {
    RayStream stream;
    prepare_one(stream, ray);
    prepare_range_of_one(stream, ray);
    const auto met = [&](const Node& node) HWY_ATTR { return met_slots(stream, 0, node); };
    return !for_each_leaf(
        bvh, met, [&](const Leaf& leaf) HWY_ATTR { return !occluded_by_leaf(stream, 0, leaf); });
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
