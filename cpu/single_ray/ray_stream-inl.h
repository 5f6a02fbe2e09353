// What the single-ray tracer takes of rays, computed for a vector of them at a time: setting rays
// up one by one took a third of the time of ambient-occlusion rays. Then a value is read of as many
// rays as there are lanes, or broadcast of one.
#if defined(MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H
#endif

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/interop/slab.h"
#include "common/simd/vectors-inl.h"
#include "cpu/simd/exact_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// Rays that are traced together; docs/cpu_tracer.md has the figures.
inline constexpr std::size_t kStreamRays = 64;

/// Some rays as the slab test and the hit rule take them.
struct alignas(64) RayStream {
    // The line is in a slab between a lower and an upper plane, dilated as in slab_ray, from one to
    // the other of t = lower * rdir - k_lower and t = upper * rdir - k_upper.
    float rdir[3][kStreamRays];
    float k_lower[3][kStreamRays];
    float k_upper[3][kStreamRays];
    // The same for near and far planes, and where a node has the near ones, by the sign of rdir.
    float k_near[3][kStreamRays];
    float k_far[3][kStreamRays];
    std::uint32_t near_offset[3][kStreamRays];
    float tnear[kStreamRays];
    float tfar[kStreamRays];
    float org[3][kStreamRays];
    float dir[3][kStreamRays];
    // With the bits of shear_ray.
    std::uint32_t axis[kStreamRays];
    float sheared_org[3][kStreamRays];
    float sheared_dir[3][kStreamRays];
    float depth_slack[kStreamRays];
    // dir.x / dir.z and dir.y / dir.z of sheared_dir, to some ulp.
    float slope[2][kStreamRays];
};

/// Bytes from a node's lower planes of an axis to the upper ones, and to the next axis. Lower
/// planes are at even multiples, so near and far are kPlaneBytes apart by an exclusive or.
inline constexpr std::uint32_t kPlaneBytes = 16 * (kNodeUpperX - kNodeLowerX);
static_assert(kPlaneBytes == 64 && kNodeLowerX == 0 && 16 * kNodeLowerY == 2 * kPlaneBytes &&
              16 * kNodeUpperY == 3 * kPlaneBytes && 16 * kNodeLowerZ == 4 * kPlaneBytes &&
              16 * kNodeUpperZ == 5 * kPlaneBytes);

/// slab_reciprocal of each lane.
HWY_INLINE FloatVec slab_reciprocals(FloatVec d) {
    const Mask none = d == zero();
    return select(none, splat(kHugeReciprocal), rcp_exactly(select(none, splat(1.0f), d)));
}

/// The dilation of boxes for each lane.
HWY_INLINE FloatVec box_dilations(const FloatVec org[3]) {
    const FloatVec extent = max3(abs(org[0]), abs(org[1]), abs(org[2]));
    return splat(kBoxDilation) * max(extent, splat(kSceneExtent));
}

HWY_INLINE void prepare_slab(RayStream& stream, std::size_t first, std::uint32_t axis, FloatVec org,
                             FloatVec dir, FloatVec dilation) {
    const FloatVec rdir = slab_reciprocals(dir);
    const Mask negative = rdir < zero();
    const FloatVec k_lower = (org + dilation) * rdir;
    const FloatVec k_upper = (org - dilation) * rdir;
    const UintVec lower = splat(2 * kPlaneBytes * axis);
    const UintVec upper = splat(2 * kPlaneBytes * axis + kPlaneBytes);
    store(rdir, stream.rdir[axis] + first);
    store(k_lower, stream.k_lower[axis] + first);
    store(k_upper, stream.k_upper[axis] + first);
    store(select(negative, k_upper, k_lower), stream.k_near[axis] + first);
    store(select(negative, k_lower, k_upper), stream.k_far[axis] + first);
    store(select(uint_mask(negative), upper, lower), stream.near_offset[axis] + first);
}

/// What shear_ray makes of the rays from `first` on.
HWY_INLINE void prepare_rule(RayStream& stream, std::size_t first, const FloatVec org[3],
                             const FloatVec dir[3]) {
    const ShearedRays s = shear_rays(org, dir);
    const UintVec not_x = select(uint_mask(s.is_y), splat(1u), splat(2u));
    store(zero_if(uint_mask(s.is_x), not_x), stream.axis + first);
    for (int k = 0; k < 3; ++k) {
        store(s.rays.org[k], stream.sheared_org[k] + first);
        store(s.rays.dir[k], stream.sheared_dir[k] + first);
    }
    store(s.rays.depth_slack, stream.depth_slack + first);
    const FloatVec dz = s.rays.dir[2];
    const Mask none = dz == zero();
    const FloatVec rdz = rcp_exactly(select(none, splat(1.0f), dz));
    for (int k = 0; k < 2; ++k) {
        store(s.rays.dir[k] * rdz, stream.slope[k] + first);
    }
}

/// Lanes [first, first + kLanes), of which org and dir are there.
HWY_INLINE void prepare_rays(RayStream& stream, std::size_t first) {
    FloatVec org[3];
    FloatVec dir[3];
    for (int axis = 0; axis < 3; ++axis) {
        org[axis] = load(stream.org[axis] + first);
        dir[axis] = load(stream.dir[axis] + first);
    }
    const FloatVec dilation = box_dilations(org);
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        prepare_slab(stream, first, axis, org[axis], dir[axis], dilation);
    }
    prepare_rule(stream, first, org, dir);
}

/// At most kStreamRays rays. Those of a last vector that are none may be computed with, but mean
/// nothing.
HWY_INLINE void fill_stream(RayStream& stream, std::span<const Ray> rays) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Ray& ray = rays[i];
        for (int axis = 0; axis < 3; ++axis) {
            stream.org[axis][i] = ray.org[axis];
            stream.dir[axis][i] = ray.dir[axis];
        }
        stream.tnear[i] = ray.tnear;
        stream.tfar[i] = ray.tfar;
    }
    // Anything but garbage, which could raise floating-point flags.
    for (std::size_t i = rays.size(); i % kLanes != 0; ++i) {
        for (int axis = 0; axis < 3; ++axis) stream.org[axis][i] = stream.dir[axis][i] = 0;
        stream.tnear[i] = stream.tfar[i] = 0;
    }
    for (std::size_t i = 0; i < rays.size(); i += kLanes) prepare_rays(stream, i);
}

/// What the rule takes of the rays from `first` on.
HWY_INLINE ShearedRays sheared_rays(const RayStream& stream, std::size_t first) {
    ShearedRays s;
    for (int k = 0; k < 3; ++k) {
        s.rays.org[k] = load(stream.sheared_org[k] + first);
        s.rays.dir[k] = load(stream.sheared_dir[k] + first);
    }
    s.rays.depth_slack = load(stream.depth_slack + first);
    const UintVec axis = load(stream.axis + first);
    s.is_x = float_mask(axis == splat(0u));
    s.is_y = float_mask(axis == splat(1u));
    return s;
}

/// Likewise of one ray in all lanes.
HWY_INLINE RuleRays rule_ray(const RayStream& stream, std::size_t ray) {
    RuleRays r;
    for (int k = 0; k < 3; ++k) {
        r.org[k] = splat(stream.sheared_org[k][ray]);
        r.dir[k] = splat(stream.sheared_dir[k][ray]);
    }
    r.depth_slack = splat(stream.depth_slack[ray]);
    return r;
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
