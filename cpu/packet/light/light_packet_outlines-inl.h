// The edges of set-up triangles against many rays at once: blocks, groups, or all that a leaf
// concerns.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_OUTLINES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_OUTLINES_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_OUTLINES_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_OUTLINES_INL_H
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

/// Rectangles of the plane, by their middles and half extents.
struct MiddleRectangles {
    HWY_INLINE MiddleRectangles(FloatVec lower_x, FloatVec upper_x, FloatVec lower_y,
                                FloatVec upper_y)
        : x(splat(0.5f) * (lower_x + upper_x)),
          y(splat(0.5f) * (lower_y + upper_y)),
          half_x(splat(0.5f) * (upper_x - lower_x)),
          half_y(splat(0.5f) * (upper_y - lower_y)) {}

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

/// Bounds of some rays.
struct PlaneRectangle {
    float lower_x, upper_x, lower_y, upper_y;
};

/// The triangles of a leaf that their edges do not exclude from a rectangle, as bits: Outline for
/// all triangles at once.
HWY_INLINE std::uint32_t triangles_through(const LightTriangles& triangles,
                                           const PlaneRectangle& rectangle) {
    const MiddleRectangles r(splat(rectangle.lower_x), splat(rectangle.upper_x),
                             splat(rectangle.lower_y), splat(rectangle.upper_y));
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
    return {load(packet.block_lower_x + block), load(packet.block_upper_x + block),
            load(packet.block_lower_y + block), load(packet.block_upper_y + block)};
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

/// The groups that meet a rectangle (lower x, upper x, lower y, upper y) and that an outline does
/// not exclude, as bits.
template <bool kOriented>
HWY_INLINE std::uint32_t groups_through(const LightPacket& packet,
                                        const Outline<kOriented>& outline,
                                        const float rectangle[4]) {
    std::uint32_t through = 0;
    const std::size_t end =
        packet.regrouped_count == 0 ? kLightPacketGroups / 2 : kLightPacketGroups;
    for (std::size_t l = 0; l < end; l += kLanes) {
        const FloatVec lower_x = load(packet.group_lower_x + l);
        const FloatVec upper_x = load(packet.group_upper_x + l);
        const FloatVec lower_y = load(packet.group_lower_y + l);
        const FloatVec upper_y = load(packet.group_upper_y + l);
        const Mask x = (splat(rectangle[0]) <= upper_x) & (splat(rectangle[1]) >= lower_x);
        const Mask y = (splat(rectangle[2]) <= upper_y) & (splat(rectangle[3]) >= lower_y);
        const Mask outside = outline.excludes({lower_x, upper_x, lower_y, upper_y});
        through |= bits_of(and_not(outside, x & y)) << l;
    }
    return through;
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
