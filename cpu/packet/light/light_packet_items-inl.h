// Set-up triangles against blocks of a light packet: which (triangle, block) items need a test at
// all, and what the bounds decide about single rays.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_ITEMS_INL_H
#endif

#include <hwy/highway.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/packet_triangles-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The triangles of a leaf whose rectangle meets a block and that are near enough for it, as bits.
HWY_INLINE std::uint32_t triangles_at(const LightPacket& packet, const LightTriangles& triangles,
                                      std::uint32_t block) {
    const RectangleLanes own(packet.blocks[block]);
    const FloatVec q = splat(packet.block_q[block]);
    std::uint32_t found = 0;
    for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
        const Mask near = load(triangles.q + l) >= q;
        found |= bits_of(near & RectangleLanes(triangles.rectangles, l).meets(own)) << l;
    }
    return found;
}

/// A set-up triangle in registers, with the error of its 1/z.
struct LightPlanes : Planes {
    HWY_INLINE LightPlanes(const LightTriangles& triangles, std::uint32_t i)
        : Planes(triangles, i),
          error0(splat(triangles.c0[i])),
          error1(splat(triangles.c1[i])),
          error2(splat(triangles.c2[i])) {}

    FloatVec error0, error1, error2;
};

/// The values of a triangle at as many rays (x, y) as there are lanes: the least edge function, and
/// 1/z from q_lower to q_upper. Overflow can make a NaN, for which both tests below are false.
struct Position {
    HWY_INLINE Position(const LightPlanes& p, FloatVec x, FloatVec y) : least(p.least_edge(x, y)) {
        const FloatVec q = p.depth(x, y);
        const FloatVec error = mul_add(q, mul_add(q, p.error2, p.error1), p.error0);
        q_lower = q - error;
        q_upper = q + error;
        is_far = q_upper * p.error2 <= splat(kFarDepth);
    }

    /// The rays that certainly hit the triangle, nearer than their limit.
    HWY_INLINE Mask is_closer(const Planes& p, FloatVec limit_upper) const {
        return (least > p.bound) & (q_lower > limit_upper);
    }

    /// The rays that certainly miss the triangle or hit it beyond their limit.
    HWY_INLINE Mask is_rejected(const Planes& p, FloatVec limit_lower) const {
        return (least < -p.bound) | (is_far & (q_upper < limit_lower));
    }

    FloatVec least, q_lower, q_upper;
    /// Where the triangle is so far away that q_upper holds.
    Mask is_far;
};

/// A set-up triangle in registers, for certainly_misses(): the largest edge functions and 1/z.
struct MissPlanes : Planes {
    HWY_INLINE MissPlanes(const LightTriangles& triangles, std::uint32_t i) : Planes(triangles, i) {
        c0 = splat(triangles.most_c[0][i]);
        c1 = splat(triangles.most_c[1][i]);
        c2 = splat(triangles.most_c[2][i]);
        depth_c = splat(triangles.most_q[i]);
    }
};

/// Whether all rays of a block certainly miss a triangle or hit it beyond their limits. It decides
/// less than Position but costs less, since its constants are found once a leaf.
///
/// 1. A ray misses where an edge function is below -bound. most_c = c + kMissBound * bound, and
///    the test is a x + b y + most_c < 0: what kMissBound exceeds 1 by covers the rounding of
///    most_c and of the sums (lab/proofs/packet_any.g).
/// 2. The bounds say nothing of a ray outside the triangle's rectangle, but such a ray misses.
/// 3. The rule hits nothing nearer than q = triangles.q, and the error c0 + q (c1 + q c2) grows
///    with q. So with most_q = depth_c + the error at that q, 1/z of a hit is at most a x + b y +
///    most_q.
/// 4. most_q has kLightErrorFactor times the error, for its own roundings, and kMissGradient
///    times the gradient for that of the sum, since |depth_c| <= 1/z in the middle + reach *
///    gradient.
HWY_INLINE bool certainly_misses(const LightPacket& packet, const MissPlanes& p,
                                 std::uint32_t block) {
    Mask all_miss = zero() == zero();
    for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
        const std::size_t r = block * kBlockRays + l;
        const FloatVec x = load(packet.x + r);
        const FloatVec y = load(packet.y + r);
        const Mask outside = p.least_edge(x, y) < zero();
        const Mask beyond = p.depth(x, y) < load(packet.q_lower + r);
        all_miss = all_miss & (outside | beyond);
    }
    return all(all_miss);
}

// The edges of set-up triangles against many rays at once: blocks, groups, or all that a leaf
// concerns.

/// Rectangles of the plane, by their middles and half extents.
struct MiddleRectangles {
    HWY_INLINE explicit MiddleRectangles(const RectangleLanes& r)
        : x(splat(0.5f) * (r.lower_x + r.upper_x)),
          y(splat(0.5f) * (r.lower_y + r.upper_y)),
          half_x(splat(0.5f) * (r.upper_x - r.lower_x)),
          half_y(splat(0.5f) * (r.upper_y - r.lower_y)) {}

    FloatVec x, y, half_x, half_y;
};

/// An edge of triangles against rectangles that are the bounds of blocks or of groups, which are
/// dilated by twice ray_error; a triangle and a rectangle a lane. `highest` is an upper bound of
/// the edge function plus its bound over a rectangle, `lowest` of its negative plus the bound: if
/// less than limit(bound), the function is certainly below -bound, or above bound, for all rays
/// there.
///
/// most_c and kBlockBound leave three quarters of `bound` on top of the test of a ray, which cover
/// four partial sums and the rounding of a rectangle's middle and half extent
/// (lab/proofs/packet_any.g). Rounding is symmetric, so that all holds for negatives, too.
struct EdgeRange {
    FloatVec a, b, most_c, most_minus_c;

    HWY_INLINE static FloatVec limit(FloatVec bound) { return splat(-kBlockBound) * bound; }

    HWY_INLINE FloatVec highest(const MiddleRectangles& r) const {
        return extent(r, mul_add(a, r.x, mul_add(b, r.y, most_c)));
    }
    HWY_INLINE FloatVec lowest(const MiddleRectangles& r) const {
        return extent(r, neg_mul_add(a, r.x, neg_mul_add(b, r.y, most_minus_c)));
    }

private:
    HWY_INLINE FloatVec extent(const MiddleRectangles& r, FloatVec middle) const {
        return mul_add(abs(a), r.half_x, mul_add(abs(b), r.half_y, middle));
    }
};

/// The edges of one triangle against many rectangles. kOriented: edge functions are positive
/// inside; else they have one sign there.
///
/// Where an oriented triangle has an edge function below -bound, the ray misses it; an unoriented
/// one, where another function is above bound as well (docs/design/arithmetic.md, "Packets",
/// step 2).
template <bool kOriented>
class Outline {
public:
    HWY_INLINE Outline(const LightTriangles& triangles, std::uint32_t i)
        : limit_(EdgeRange::limit(splat(triangles.bound[i]))) {
        for (int k = 0; k < 3; ++k) {
            const float most_minus_c = kMissBound * triangles.bound[i] - triangles.c[k][i];
            edges_[k] = {splat(triangles.a[k][i]), splat(triangles.b[k][i]),
                         splat(triangles.most_c[k][i]), splat(most_minus_c)};
        }
        const float gradient = std::abs(triangles.depth_a[i]) + std::abs(triangles.depth_b[i]);
        depth_a_ = splat(triangles.depth_a[i]);
        depth_b_ = splat(triangles.depth_b[i]);
        most_q_ = splat(triangles.most_q[i] + kBlockGradient * gradient);
    }

    /// The blocks whose rays all end before they reach the triangle: block_q is the least 1/z of
    /// their ends. As certainly_misses() for a ray; kBlockGradient of the gradient covers a
    /// rectangle's middle and half extent and four partial sums (lab/proofs/packet_any.g).
    HWY_INLINE Mask is_beyond(const MiddleRectangles& r, FloatVec block_q) const {
        const FloatVec middle = mul_add(depth_a_, r.x, mul_add(depth_b_, r.y, most_q_));
        const FloatVec most =
            mul_add(abs(depth_a_), r.half_x, mul_add(abs(depth_b_), r.half_y, middle));
        return most < block_q;
    }

    /// The rectangles of which no ray hits the triangle.
    HWY_INLINE Mask excludes(const MiddleRectangles& r) const {
        const FloatVec high =
            min3(edges_[0].highest(r), edges_[1].highest(r), edges_[2].highest(r));
        if constexpr (kOriented) return high < limit_;
        const FloatVec low = min3(edges_[0].lowest(r), edges_[1].lowest(r), edges_[2].lowest(r));
        return (high < limit_) & (low < limit_);
    }

private:
    EdgeRange edges_[3];
    FloatVec limit_;
    FloatVec depth_a_, depth_b_, most_q_;
};

/// The triangles of a leaf that their edges do not exclude from a rectangle, as bits: Outline for
/// all triangles at once.
HWY_INLINE std::uint32_t triangles_through(const LightTriangles& triangles,
                                           const PlaneRectangle& rectangle) {
    const MiddleRectangles r{RectangleLanes(rectangle)};
    std::uint32_t below = 0;
    std::uint32_t above = 0;
    for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
        const FloatVec bound = load(triangles.bound + l);
        const FloatVec limit = EdgeRange::limit(bound);
        FloatVec high[3], low[3];
        for (int k = 0; k < 3; ++k) {
            const FloatVec most_minus_c = splat(kMissBound) * bound - load(triangles.c[k] + l);
            const EdgeRange edge = {load(triangles.a[k] + l), load(triangles.b[k] + l),
                                    load(triangles.most_c[k] + l), most_minus_c};
            high[k] = edge.highest(r);
            low[k] = edge.lowest(r);
        }
        below |= bits_of(min3(high[0], high[1], high[2]) < limit) << l;
        above |= bits_of(min3(low[0], low[1], low[2]) < limit) << l;
    }
    return ~(below & (above | ~triangles.unoriented));
}

/// The bounds of a vector of blocks.
HWY_INLINE MiddleRectangles rectangles_of(const LightPacket& packet, std::size_t block) {
    return MiddleRectangles(RectangleLanes(packet.blocks, block));
}

/// The blocks of a group that reach an oriented triangle, or may, as bits.
HWY_INLINE std::uint32_t blocks_reaching(const LightPacket& packet, const Outline<true>& outline,
                                         std::uint32_t group) {
    std::uint32_t reaching = 0;
    for (std::size_t l = 0; l < kGroupBlocks; l += kLanes) {
        const std::size_t block = group * kGroupBlocks + l;
        const Mask is_beyond =
            outline.is_beyond(rectangles_of(packet, block), load(packet.block_q + block));
        reaching |= bits_of(!is_beyond) << l;
    }
    return reaching;
}

/// The blocks of a group that an outline does not exclude, as bits.
template <bool kOriented>
HWY_INLINE std::uint32_t blocks_through(const LightPacket& packet,
                                        const Outline<kOriented>& outline, std::uint32_t group) {
    std::uint32_t through = 0;
    for (std::size_t l = 0; l < kGroupBlocks; l += kLanes) {
        const std::size_t block = group * kGroupBlocks + l;
        const Mask outside = outline.excludes(rectangles_of(packet, block));
        through |= bits_of(!outside) << l;
    }
    return through;
}

/// The groups that meet a rectangle and that an outline does not exclude, as bits.
template <bool kOriented>
HWY_INLINE std::uint32_t groups_through(const LightPacket& packet,
                                        const Outline<kOriented>& outline,
                                        const RectangleLanes& rectangle) {
    std::uint32_t through = 0;
    const std::size_t end =
        packet.regrouped_count == 0 ? kLightPacketGroups / 2 : kLightPacketGroups;
    for (std::size_t l = 0; l < end; l += kLanes) {
        const RectangleLanes own(packet.groups, l);
        const Mask outside = outline.excludes(MiddleRectangles(own));
        through |= bits_of(and_not(outside, rectangle.meets(own))) << l;
    }
    return through;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
