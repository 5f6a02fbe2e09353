// What the wide tracer takes of rays, computed for a vector of them at a time and then broadcast
// for one: setting rays up one by one took a third of the time of ambient-occlusion rays.
#if defined(MORPHRAY_CPU_RAY_STREAM_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_RAY_STREAM_INL_H
#undef MORPHRAY_CPU_RAY_STREAM_INL_H
#else
#define MORPHRAY_CPU_RAY_STREAM_INL_H
#endif

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/interop/slab.h"
#include "cpu/wide_vector-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

// Rays that are traced together; docs/cpu_tracer.md has the figures.
inline constexpr std::size_t kStreamRays = 64;

/// SlabRay and ShearedRay of some rays, with the bits of slab_ray and shear_ray.
struct alignas(64) RayStream {
    float rdir[3][kStreamRays];
    // What near and far planes are taken relative to, and where a node has the near planes, by the
    // sign of the direction.
    float near_org[3][kStreamRays];
    float far_org[3][kStreamRays];
    std::uint32_t near_offset[3][kStreamRays];
    float tfar[kStreamRays];
    // With rotated axes.
    float org[3][kStreamRays];
    float dir[3][kStreamRays];
    std::uint32_t axis[kStreamRays];
};

/// Bytes from a node's lower planes of an axis to the upper ones, and to the next axis. Lower
/// planes are at even multiples, so near and far are kPlaneBytes apart by an exclusive or.
inline constexpr std::uint32_t kPlaneBytes = 16 * (kNodeUpperX - kNodeLowerX);
static_assert(kPlaneBytes == 64 && kNodeLowerX == 0 && 16 * kNodeLowerY == 2 * kPlaneBytes &&
              16 * kNodeUpperY == 3 * kPlaneBytes && 16 * kNodeLowerZ == 4 * kPlaneBytes &&
              16 * kNodeUpperZ == 5 * kPlaneBytes);

/// slab_reciprocal of each lane.
HWY_INLINE FloatVec slab_reciprocals(FloatVec d) {
    const FloatVec one = broadcast(1.0f);
    const FloatVec two = broadcast(2.0f);
    const FloatMask none = hn::Eq(d, hn::Zero(kFloats));
    const FloatVec ad = hn::IfThenElse(none, one, hn::Abs(d));
    FloatVec y =
        hn::BitCast(kFloats, hn::Sub(hn::Set(kUints, 0x7EF311C7u), hn::BitCast(kUints, ad)));
    y = hn::Mul(y, hn::Sub(two, hn::Mul(ad, y)));
    y = hn::Mul(y, hn::Sub(two, hn::Mul(ad, y)));
    y = hn::Add(y, hn::Mul(y, hn::Sub(one, hn::Mul(ad, y))));
    y = hn::IfThenElse(hn::Lt(d, hn::Zero(kFloats)), hn::Neg(y), y);
    return hn::IfThenElse(none, broadcast(kHugeReciprocal), y);
}

/// The operations of slab_ray on one axis.
HWY_INLINE void prepare_slab(RayStream& stream, std::size_t first, std::uint32_t axis, FloatVec org,
                             FloatVec dir, FloatVec dilation) {
    const FloatVec rdir = slab_reciprocals(dir);
    const FloatMask negative = hn::Lt(rdir, hn::Zero(kFloats));
    const FloatVec for_lower = hn::Add(org, dilation);
    const FloatVec for_upper = hn::Sub(org, dilation);
    const UintVec lower = hn::Set(kUints, 2 * kPlaneBytes * axis);
    const UintVec upper = hn::Set(kUints, 2 * kPlaneBytes * axis + kPlaneBytes);
    hn::StoreU(rdir, kFloats, stream.rdir[axis] + first);
    hn::StoreU(hn::IfThenElse(negative, for_upper, for_lower), kFloats,
               stream.near_org[axis] + first);
    hn::StoreU(hn::IfThenElse(negative, for_lower, for_upper), kFloats,
               stream.far_org[axis] + first);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(kUints, negative), upper, lower), kUints,
               stream.near_offset[axis] + first);
}

/// Lanes [first, first + kLanes), of which org and dir are those of the rays.
HWY_INLINE void prepare_rays(RayStream& stream, std::size_t first) {
    FloatVec org[3];
    FloatVec dir[3];
    FloatVec size[3];
    FloatVec extent = broadcast(kSceneExtent);
    for (int axis = 0; axis < 3; ++axis) {
        org[axis] = hn::LoadU(kFloats, stream.org[axis] + first);
        dir[axis] = hn::LoadU(kFloats, stream.dir[axis] + first);
        size[axis] = hn::Abs(dir[axis]);
        extent = hn::Max(extent, hn::Abs(org[axis]));
    }
    const FloatVec dilation = hn::Mul(broadcast(kBoxDilation), extent);
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
        prepare_slab(stream, first, axis, org[axis], dir[axis], dilation);
    }
    const FloatMask is_x = hn::And(hn::Ge(size[0], size[1]), hn::Ge(size[0], size[2]));
    const FloatMask is_y = hn::Ge(size[1], size[2]);
    for (int k = 0; k < 3; ++k) {
        const auto rotated = [&](const FloatVec* v) {
            return hn::IfThenElse(is_x, v[(k + 1) % 3], hn::IfThenElse(is_y, v[(k + 2) % 3], v[k]));
        };
        hn::StoreU(rotated(org), kFloats, stream.org[k] + first);
        hn::StoreU(rotated(dir), kFloats, stream.dir[k] + first);
    }
    const UintVec not_x =
        hn::IfThenElse(hn::RebindMask(kUints, is_y), hn::Set(kUints, 1u), hn::Set(kUints, 2u));
    hn::StoreU(hn::IfThenElse(hn::RebindMask(kUints, is_x), hn::Zero(kUints), not_x), kUints,
               stream.axis + first);
}

/// At most kStreamRays rays.
HWY_INLINE void fill_stream(RayStream& stream, std::span<const Ray> rays) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Ray& ray = rays[i];
        stream.org[0][i] = ray.org.x;
        stream.org[1][i] = ray.org.y;
        stream.org[2][i] = ray.org.z;
        stream.dir[0][i] = ray.dir.x;
        stream.dir[1][i] = ray.dir.y;
        stream.dir[2][i] = ray.dir.z;
        stream.tfar[i] = ray.tfar;
    }
    // The rest of the last vector: anything but garbage, which could raise floating-point flags.
    for (std::size_t i = rays.size(); i % kLanes != 0; ++i) {
        for (int axis = 0; axis < 3; ++axis) stream.org[axis][i] = stream.dir[axis][i] = 0;
    }
    for (std::size_t i = 0; i < rays.size(); i += kLanes) prepare_rays(stream, i);
}

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif  // per target
