// Streams: rays of one octant as the single-ray tracer reads them, prepared a vector at a time,
// because preparing them one by one takes much of the time of ambient-occlusion rays.
#if defined(MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H
#undef MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H
#else
#define MORPHRAY_CPU_SINGLE_RAY_RAY_STREAM_INL_H
#endif

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>

#include "common/interop/packet_bounds.h"
#include "common/interop/slab.h"
#include "common/scene_queries.h"
#include "cpu/simd/lanes-inl.h"
#include "cpu/simd/node-inl.h"
#include "cpu/simd/rounding_bounds.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// Rays that are traced together; lab/notes/cpu_tracer.md has the figures.
inline constexpr std::size_t kStreamRays = 64;

/// Stands for the main axis of a ray where it is known at run time only.
inline constexpr int kAnyAxis = -1;

/// Some rays as the slab test and the hit rule take them.
template <std::size_t kRays>
struct alignas(64) RaysOfStream {
    // The line is in a slab between a near and a far plane, dilated and prolonged (prepare_slab),
    // between t = near * rdir - k_near and t = far * rdir_far - k_far. The sign of rdir tells which
    // of a node's planes are the near ones; near_offset is their plane_offset().
    float rdir[3][kRays], rdir_far[3][kRays];
    float k_near[3][kRays], k_far[3][kRays];
    std::uint32_t near_offset[3][kRays];
    float tnear[kRays], tfar[kRays], least_dilation[kRays];
    float depth_margin[kRays];
    float last_depth[kRays];  // of tfar
    float org[3][kRays], dir[3][kRays];
    // With the bits of shear_ray.
    std::uint32_t axis[kRays];
    float sheared_org[3][kRays], sheared_dir[3][kRays], depth_slack[kRays];
    // depthless_bound()
    float bound_linear[kRays], bound_constant[kRays];
    // dir.x / dir.z and dir.y / dir.z of sheared_dir, to some ulp.
    float slope[2][kRays];
    // The |z| relative to the origin between which a triangle is certainly in range
    // (cpu/single_ray/leaf-inl.h), none if certain_to is negative; and from which on it is
    // certainly beyond tfar.
    float certain_from[kRays], certain_to[kRays], certain_beyond[kRays];
    Crossing crossing = Crossing::kEach;
};
using RayStream = RaysOfStream<kStreamRays>;

inline constexpr float kStreamDilation = HWY_NATIVE_FMA ? kFusedDilation : kUnfusedDilation;
inline constexpr float kStreamRounding = HWY_NATIVE_FMA ? kFusedSlabRounding : kSlabRounding;

/// Prepares an axis; `least` is least_dilation().
HWY_INLINE void prepare_slab(RayStream& stream, std::size_t first, std::uint32_t axis, FloatVec org,
                             FloatVec dir, FloatVec least) {
    const Mask is_zero = dir == zero();
    const FloatVec rdir =
        select(is_zero, splat(kHugeReciprocal), hn::Div(splat(1.0f), select(is_zero, 1.0f, dir)));
    const FloatVec rdir_far = rdir * kStreamRounding;
    const Mask negative = rdir < zero();
    const FloatVec dilation = (kStreamDilation * abs(org) + kLeastDilations * least) * abs(rdir);
    const UintVec lower = splat(plane_offset(axis, 0));
    const UintVec upper = splat(plane_offset(axis, 1));
    store(rdir, stream.rdir[axis] + first);
    store(rdir_far, stream.rdir_far[axis] + first);
    store(mul_add(org, rdir, dilation), stream.k_near[axis] + first);
    store(mul_sub(org, rdir_far, dilation), stream.k_far[axis] + first);
    store(select(uint_mask(negative), upper, lower), stream.near_offset[axis] + first);
}

/// The largest |z| of a vertex for rays whose sheared origin has this |z|: z is a rounded
/// difference, and rounding is monotone.
template <class Value>
HWY_INLINE Value most_depth(Value org_size) {
    return org_size + kSceneExtent;
}

/// A bound of edge functions that needs no z: at least edge_bound(m, Z) for every m and every Z up
/// to most_depth(), fused or not (docs/design/arithmetic.md, "Rays without packets").
template <class Value>
struct DepthlessBound {
    Value linear, constant;

    HWY_INLINE Value operator()(Value m) const {
        return mul_add(mul_add(splat(2 * kFastProjectionError * kDepthlessBound), m, linear), m,
                       constant);
    }
};

template <class Value>
HWY_INLINE DepthlessBound<Value> depthless_bound(Value depth) {
    const Value q = depth * kFastProjectionError + kFastProjectionFloor;
    const Value linear = q * kDepthlessBound;
    return {linear, (q + q) * linear};
}

/// shear_ray() and the slopes of the rays from `first` on.
HWY_INLINE void prepare_rule(RayStream& stream, std::size_t first, const lanes::Float3& org,
                             const lanes::Float3& dir) {
    const lanes::ShearedRay s = lanes::shear_ray(org, dir);
    store(s.axis, stream.axis + first);
    store3(s.org, stream.sheared_org, first);
    store3(s.dir, stream.sheared_dir, first);
    store(s.depth_slack, stream.depth_slack + first);
    const DepthlessBound<FloatVec> bound = depthless_bound(most_depth(abs(s.org.z)));
    store(bound.linear, stream.bound_linear + first);
    store(bound.constant, stream.bound_constant + first);
    const FloatVec rdz = lanes::rcp(select(s.dir.z == zero(), 1.0f, s.dir.z));
    store(s.dir.x * rdz, stream.slope[0] + first);
    store(s.dir.y * rdz, stream.slope[1] + first);
}

/// Sets the range in which a hit's depth is certain, for the rays from `first` on.
HWY_INLINE void prepare_range(RayStream& stream, std::size_t first, const lanes::Float3& org) {
    const FloatVec size = lanes::extent_of_rays(org);
    const FloatVec margin = kCertainDepth * size;
    const FloatVec dz = abs(load(stream.sheared_dir[2] + first));
    const FloatVec from = load(stream.tnear + first) * dz + margin;
    const FloatVec end = min(load(stream.tfar + first) * dz, 4.0f * size);
    const Mask is_near = size <= splat(kCertainOrigin);
    store(from, stream.certain_from + first);
    store(select(is_near, end - margin, -1.0f), stream.certain_to + first);
    store(select(is_near, end + kBeyondDepth * size, kHugeReciprocal),
          stream.certain_beyond + first);
}

/// Prepares the rays [first, first + kLanes), of which org, dir, tnear and tfar are set.
HWY_INLINE void prepare_rays(RayStream& stream, std::size_t first) {
    FloatVec org[3], dir[3];
    for (int axis = 0; axis < 3; ++axis) {
        org[axis] = load(stream.org[axis] + first);
        dir[axis] = load(stream.dir[axis] + first);
    }
    const FloatVec least = lanes::least_dilation(lanes::Float3(org));
    const FloatVec margin = lanes::depth_margin(lanes::Float3(org));
    store(least, stream.least_dilation + first);
    store(margin, stream.depth_margin + first);
    store(lanes::last_depth(load(stream.tfar + first)), stream.last_depth + first);
    for (std::uint32_t axis = 0; axis < 3; ++axis)
        prepare_slab(stream, first, axis, org[axis], dir[axis], least);
    prepare_rule(stream, first, lanes::Float3(org), lanes::Float3(dir));
    prepare_range(stream, first, lanes::Float3(org));
}

/// Copies the first rays, by fours; returns how many.
HWY_INLINE std::size_t copy_rays_by_four([[maybe_unused]] RayStream& stream,
                                         [[maybe_unused]] const Ray* rays,
                                         [[maybe_unused]] std::span<const std::uint16_t> order) {
    std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
    static_assert(sizeof(Ray) == 32 && offsetof(Ray, tnear) == 12 && offsetof(Ray, dir) == 16);
    constexpr hn::FixedTag<float, 4> kFour;
    using Four = hn::Vec<hn::FixedTag<float, 4>>;
    for (; i + 4 <= order.size(); i += 4) {
        Four start[4], end[4], out[4];
        for (std::size_t k = 0; k < 4; ++k) {
            const auto* const ray = reinterpret_cast<const float*>(&rays[order[i + k]]);
            start[k] = hn::LoadU(kFour, ray);
            end[k] = hn::LoadU(kFour, ray + 4);
        }
        transpose_fours(kFour, start, out);
        for (int axis = 0; axis < 3; ++axis) hn::StoreU(out[axis], kFour, stream.org[axis] + i);
        hn::StoreU(out[3], kFour, stream.tnear + i);
        transpose_fours(kFour, end, out);
        for (int axis = 0; axis < 3; ++axis) hn::StoreU(out[axis], kFour, stream.dir[axis] + i);
        hn::StoreU(out[3], kFour, stream.tfar + i);
    }
#endif
    return i;
}

/// Prepares rays[order[i]], at least one and at most kStreamRays. Lanes of the last vector beyond
/// them repeat the last one.
HWY_INLINE RayStream make_stream(const Ray* rays, std::span<const std::uint16_t> order) {
    RayStream stream;
    const std::size_t last = order.size() - 1;
    const std::size_t last_vector = last / kLanes * kLanes;
    const Ray& last_ray = rays[order[last]];
    for (int axis = 0; axis < 3; ++axis) {
        store(splat(last_ray.org[axis]), stream.org[axis] + last_vector);
        store(splat(last_ray.dir[axis]), stream.dir[axis] + last_vector);
    }
    store(splat(last_ray.tnear), stream.tnear + last_vector);
    store(splat(last_ray.tfar), stream.tfar + last_vector);
    for (std::size_t i = copy_rays_by_four(stream, rays, order.first(last)); i < last; ++i) {
        const Ray& ray = rays[order[i]];
        for (int axis = 0; axis < 3; ++axis) {
            stream.org[axis][i] = ray.org[axis];
            stream.dir[axis][i] = ray.dir[axis];
        }
        stream.tnear[i] = ray.tnear;
        stream.tfar[i] = ray.tfar;
    }
    for (std::size_t first = 0; first < order.size(); first += kLanes) prepare_rays(stream, first);
    return stream;
}

/// Values of a stream in lanes: of the rays from `first` on, or of one ray.
struct RaysFrom {
    std::size_t first;
    template <class T>
    HWY_INLINE auto operator()(const T* values) const {
        return load(values + first);
    }
};
struct OneRay {
    std::size_t ray;
    template <class T>
    HWY_INLINE auto operator()(const T* values) const {
        return splat(values[ray]);
    }
};

/// Rays, RaysFrom or OneRay, as the rule takes them.
template <class Stream, class Rays>
HWY_INLINE lanes::ShearedRay sheared(const Stream& stream, Rays of) {
    const auto vector = [&](const auto* values) HWY_ATTR {
        return lanes::Float3(of(values[0]), of(values[1]), of(values[2]));
    };
    lanes::ShearedRay s;
    s.org = vector(stream.sheared_org);
    s.dir = vector(stream.sheared_dir);
    s.axis = of(stream.axis);
    s.depth_slack = of(stream.depth_slack);
    return s;
}

// Rays that are ordered together. Neighbours in a batch stay neighbours in a stream.
inline constexpr std::size_t kBatchRays = 2048;

/// The signs of dir as bits. A zero counts as positive, as it does in rdir.
HWY_INLINE std::uint8_t octant_of(vec3 dir) {
    return static_cast<std::uint8_t>((dir.x < 0) + 2 * (dir.y < 0) + 4 * (dir.z < 0));
}

/// The indices of at most kBatchRays rays: octant k has order[begin[k] .. begin[k + 1]).
struct OctantOrder {
    static constexpr std::size_t kOctants = 8;
    std::uint16_t order[kBatchRays];
    std::size_t begin[kOctants + 1];

    HWY_INLINE explicit OctantOrder(std::span<const Ray> rays) {
        std::uint8_t octants[kBatchRays];
        std::uint32_t next[kParts][kOctants] = {};
        for_each(rays.size(), [&](std::size_t part, std::size_t i) {
            octants[i] = octant_of(rays[i].dir);
            ++next[part][octants[i]];
        });
        std::uint32_t sum = 0;
        for (std::size_t octant = 0; octant < kOctants; ++octant) {
            begin[octant] = sum;
            for (auto& of_part : next) sum += std::exchange(of_part[octant], sum);
        }
        begin[kOctants] = sum;
        for_each(rays.size(), [&](std::size_t part, std::size_t i) {
            order[next[part][octants[i]]++] = static_cast<std::uint16_t>(i);
        });
    }

private:
    // Parts of the batch that rays are taken from in turn, because a counter that was just written
    // takes some cycles until it can be read.
    static constexpr std::size_t kParts = 4;

    /// Calls visit(part, i) for each i below count, where each part has its indices in order.
    template <class Visit>
    HWY_INLINE static void for_each(std::size_t count, Visit visit) {
        const std::size_t size = count / kParts;
        for (std::size_t i = 0; i < size; ++i) {
            for (std::size_t part = 0; part < kParts; ++part) visit(part, part * size + i);
        }
        for (std::size_t i = kParts * size; i < count; ++i) visit(kParts - 1, i);
    }
};

/// Calls trace(batch, order, first) for the streams of any rays, at most kStreamRays of one octant
/// each, where batch are the rays from `first` on.
template <class Trace>
HWY_INLINE void for_each_stream(std::span<const Ray> rays, Trace trace) {
    // A few rays of one octant, such as those of a packet, need no order.
    const auto is_like_first = [&](const Ray& ray) HWY_ATTR {
        return octant_of(ray.dir) == octant_of(rays[0].dir);
    };
    if (!rays.empty() && rays.size() <= kStreamRays && std::ranges::all_of(rays, is_like_first)) {
        std::uint16_t order[kStreamRays];
        std::iota(order, order + rays.size(), std::uint16_t{0});
        return trace(rays.data(), std::span(order, rays.size()), 0);
    }
    for (std::size_t first = 0; first < rays.size(); first += kBatchRays) {
        const auto batch = rays.subspan(first, std::min(kBatchRays, rays.size() - first));
        const OctantOrder order(batch);
        for (std::size_t octant = 0; octant < OctantOrder::kOctants; ++octant) {
            const std::size_t end = order.begin[octant + 1];
            for (std::size_t i = order.begin[octant]; i < end; i += kStreamRays)
                trace(batch.data(), std::span(order.order + i, std::min(kStreamRays, end - i)),
                      first);
        }
    }
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per target
