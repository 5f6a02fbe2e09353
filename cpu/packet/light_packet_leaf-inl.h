// Any hits of a point's packet: the triangles of a leaf against blocks of rays.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_PACKET_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_PACKET_LEAF_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_PACKET_LEAF_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_PACKET_LEAF_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/light_packet_rays-inl.h"
#include "cpu/packet/packet.h"
#include "cpu/packet/packet_blocks-inl.h"
#include "cpu/packet/packet_hit_rule-inl.h"
#include "cpu/packet/packet_items-inl.h"
#include "cpu/packet/triangle_setup-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {

/// Writes down the bits of a mask, 0 standing for `first`, behind `count` numbers; how many there
/// are then. Without a branch on the mask where there are instructions for that: what is done with
/// a number takes less than a wrong guess of how many follow. `numbers` has room for 15 more.
HWY_INLINE std::size_t append_bits(std::uint32_t* numbers, std::size_t count, std::uint32_t first,
                                   std::uint32_t mask) {
#if HWY_TARGET <= HWY_AVX3
    const UintVec all = hn::Iota(kUints, 0) + splat(first);
    store_unaligned(hn::Compress(all, uint_mask(mask_of(mask))), numbers + count);
    return count + hwy::PopCount(mask);
#else
    for (; mask != 0; mask &= mask - 1)
        numbers[count++] = first + static_cast<std::uint32_t>(__builtin_ctz(mask));
    return count;
#endif
}

/// Finds what is nearer than all that the rays of a point's block have found, and those of its
/// quad.
HWY_INLINE void find_point_depth(Packet& packet, std::uint32_t block) {
    find_depth(packet, block);
    const std::uint32_t quad = block / kQuadBlocks;
    const float* block_q = packet.block_q + quad * kQuadBlocks;
    packet.quad_q[quad] =
        std::min(std::min(block_q[0], block_q[1]), std::min(block_q[2], block_q[3]));
}

// Of 1 / tfar in z, from 1 - 2^-18 to 1 + 2^-18 times what is computed; 2^-20 for rounding.
constexpr float kUpperByLower = 1 + 0x1p-17f + 0x1p-20f;

/// Finds which rays of a packet leaves occlude.
class LeafOcclusion {
public:
    explicit LeafOcclusion(Packet& packet) : packet_(packet) {}

    /// A leaf whose box is seen in a rectangle, no nearer than q, against some quads.
    HWY_INLINE void trace(const Leaf& leaf, const float rectangle[4], float q,
                          const QuadSet& quads) {
        const std::size_t count = list_blocks(rectangle, q, quads);
        if (count == 0) return;
        const std::uint32_t alive = TriangleSetup<false>(packet_.frame).run(leaf, setup_);
        if (count > kManyBlocks * hwy::PopCount(alive))
            return trace_triangles(leaf, alive, rectangle, q, quads);
        for (std::size_t begin = 0; begin < count; begin += kBlocksAtOnce) {
            const std::size_t end = std::min(begin + kBlocksAtOnce, count);
            trace_pairs(leaf, list_pairs(alive, begin, end));
        }
    }

private:
    /// The first quads of groups that have some.
    static HWY_INLINE std::uint64_t groups_of(std::uint64_t quads) {
        const std::uint64_t pairs = quads | quads >> 1;
        return (pairs | pairs >> 2) & 0x1111111111111111;
    }

    /// Blocks of a group, as bits.
    struct GroupPart {
        std::uint32_t group, blocks;
    };

    static constexpr std::size_t kBlocksAtOnce = 64;

    // With so many blocks for each triangle, triangles are taken one by one with their blocks.
    static constexpr std::size_t kManyBlocks = 6;

    /// Calls visit(group, blocks) for the groups of some quads and their blocks that a rectangle at
    /// 1/z = q or less may concern.
    template <class Visit>
    HWY_INLINE void for_each_group(const float rectangle[4], float q, const QuadSet& quads,
                                   Visit visit) const {
        for (std::uint32_t word = 0; word < 2; ++word) {
            for (std::uint64_t groups = groups_of(quads.words[word]); groups != 0;
                 groups &= groups - 1) {
                const std::uint32_t group =
                    (64 * word + static_cast<std::uint32_t>(__builtin_ctzll(groups))) /
                    (kGroupBlocks / kQuadBlocks);
                visit(group, blocks_in(packet_, rectangle, q, group));
            }
        }
    }

    /// Those blocks; how many.
    HWY_INLINE std::size_t list_blocks(const float rectangle[4], float q, const QuadSet& quads) {
        std::size_t count = 0;
        for_each_group(rectangle, q, quads,
                       [&](std::uint32_t group, std::uint32_t blocks) HWY_ATTR {
                           count = append_bits(blocks_, count, group * kGroupBlocks, blocks);
                       });
        return count;
    }

    /// The pairs of some of these blocks and the triangles that meet them; how many.
    HWY_INLINE std::size_t list_pairs(std::uint32_t triangles, std::size_t begin, std::size_t end) {
        std::size_t count = 0;
        for (std::size_t k = begin; k < end; ++k) {
            const std::uint32_t block = blocks_[k];
            count = append_bits(pairs_, count, block * kLeafTriangles,
                                triangles & triangles_at(packet_, setup_, block));
        }
        return count;
    }

    /// Most triangles are those of the surface that the rays end at: those that do not certainly
    /// lose are written down first.
    HWY_INLINE void trace_pairs(const Leaf& leaf, std::size_t count) {
        std::size_t open = 0;
        for (std::size_t k = 0; k < count; ++k) {
            const std::uint32_t pair = pairs_[k];
            pairs_[open] = pair;
            const LosingPlanes planes(setup_, pair % kLeafTriangles);
            open += certainly_loses(planes, pair / kLeafTriangles) ? 0 : 1;
        }
        for (std::size_t k = 0; k < open; ++k)
            occlude(leaf, pairs_[k] / kLeafTriangles, pairs_[k] % kLeafTriangles);
    }

    /// Likewise triangle by triangle, which are read once, and with all blocks of the leaf.
    HWY_NOINLINE void trace_triangles(const Leaf& leaf, std::uint32_t triangles,
                                      const float rectangle[4], float q, const QuadSet& quads) {
        GroupPart groups[kLightPacketGroups];
        std::size_t group_count = 0;
        for_each_group(rectangle, q, quads,
                       [&](std::uint32_t group, std::uint32_t blocks) HWY_ATTR {
                           groups[group_count++] = {group, blocks};
                       });
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(triangles));
            const std::size_t count = list_blocks_of(i, std::span(groups, group_count));
            const LosingPlanes planes(setup_, i);
            std::size_t open = 0;
            for (std::size_t k = 0; k < count; ++k) {
                const std::uint32_t block = blocks_[k];
                blocks_[open] = block;
                open += certainly_loses(planes, block) ? 0 : 1;
            }
            for (std::size_t k = 0; k < open; ++k) occlude(leaf, blocks_[k], i);
        }
    }

    // Triangles that meet so many blocks are larger than them, and have edges that leave some out.
    static constexpr std::size_t kManyOfTriangle = 16;

    /// The blocks of the leaf that a triangle meets; how many.
    HWY_INLINE std::size_t list_blocks_of(std::uint32_t i, std::span<const GroupPart> groups) {
        const float rectangle[4] = {setup_.rectangles.lower_x[i], setup_.rectangles.upper_x[i],
                                    setup_.rectangles.lower_y[i], setup_.rectangles.upper_y[i]};
        const float q = setup_.q[i];
        std::size_t count = 0;
        for (const GroupPart& part : groups) {
            count = append_bits(blocks_, count, part.group * kGroupBlocks,
                                part.blocks & blocks_in(packet_, rectangle, q, part.group));
        }
        if (HWY_LIKELY(count <= kManyOfTriangle)) return count;
        count = 0;
        for (const GroupPart& part : groups) {
            const std::uint32_t blocks =
                blocks_through(i, part.group) & blocks_in(packet_, rectangle, q, part.group);
            count = append_bits(blocks_, count, part.group * kGroupBlocks, part.blocks & blocks);
        }
        return count;
    }

    /// The blocks of a group but for those that have all of their bounds outside of an edge of a
    /// triangle. The bounds are dilated by twice ray_error, and most_c and kBlockBound leave three
    /// quarters of a bound on top of the plain test, which cover four partial sums and what is lost
    /// in a block's middle and half extent (proofs/packet_any.g).
    HWY_INLINE std::uint32_t blocks_through(std::uint32_t i, std::uint32_t group) const {
        const FloatVec half = splat(0.5f);
        std::uint32_t through = 0;
        for (std::size_t l = 0; l < kGroupBlocks; l += kLanes) {
            const std::size_t b = group * kGroupBlocks + l;
            const FloatVec lower_x = load(packet_.block_lower_x + b);
            const FloatVec upper_x = load(packet_.block_upper_x + b);
            const FloatVec lower_y = load(packet_.block_lower_y + b);
            const FloatVec upper_y = load(packet_.block_upper_y + b);
            const FloatVec x = half * (lower_x + upper_x);
            const FloatVec y = half * (lower_y + upper_y);
            const FloatVec half_x = half * (upper_x - lower_x);
            const FloatVec half_y = half * (upper_y - lower_y);
            FloatVec edge[3];
            for (int k = 0; k < 3; ++k) {
                const FloatVec a = splat(setup_.a[k][i]);
                const FloatVec b_ = splat(setup_.b[k][i]);
                const FloatVec middle = mul_add(a, x, mul_add(b_, y, splat(setup_.most_c[k][i])));
                edge[k] = mul_add(abs(a), half_x, mul_add(abs(b_), half_y, middle));
            }
            const FloatVec least = min(edge[0], min(edge[1], edge[2]));
            const Mask out = least < splat(-kBlockBound * setup_.bound[i]);
            through |= bits_of(!out) << l;
        }
        return through;
    }

    /// What certainly_loses() knows of a triangle.
    struct LosingPlanes {
        HWY_INLINE LosingPlanes(const Setup& setup, std::uint32_t i)
            : a{splat(setup.a[0][i]), splat(setup.a[1][i]), splat(setup.a[2][i])},
              b{splat(setup.b[0][i]), splat(setup.b[1][i]), splat(setup.b[2][i])},
              c{splat(setup.most_c[0][i]), splat(setup.most_c[1][i]), splat(setup.most_c[2][i])},
              depth_a(splat(setup.depth_a[i])),
              depth_b(splat(setup.depth_b[i])),
              depth_c(splat(setup.most_q[i])) {}

        FloatVec a[3], b[3], c[3], depth_a, depth_b, depth_c;
    };

    /// Whether all rays of a block certainly lose against a triangle, by constants that are found
    /// once a leaf: less than a Position takes, and few pairs that lose are missed. Of the edges,
    /// most_c is c + kLosingBound bound. The plain test is least < -bound; the rounding of most_c,
    /// and what it adds to those of the sums, is less than the rest (proofs/packet_any.g). A ray
    /// outside the rectangle, of which the bounds say nothing, loses anyway. Of the depth, most_q
    /// is depth_c plus the error c0 + q (c1 + q c2) at q = setup.q: the rule hits nothing nearer
    /// than that, and the error grows with q, so 1/z of a hit is at most a x + b y + most_q. Added
    /// are 2^-18 of the error for its own roundings and kLosingGradient of the gradient for that of
    /// the sum: depth_c is at most 1/z in the middle and frame.reach times the gradient.
    HWY_INLINE bool certainly_loses(const LosingPlanes& p, std::uint32_t block) const {
        Mask all_lose = zero() == zero();
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec x = load(packet_.x + r);
            const FloatVec y = load(packet_.y + r);
            const auto edge = [&](int k) HWY_ATTR {
                return mul_add(p.a[k], x, mul_add(p.b[k], y, p.c[k]));
            };
            const FloatVec q = mul_add(p.depth_a, x, mul_add(p.depth_b, y, p.depth_c));
            const Mask outside = min(edge(0), min(edge(1), edge(2))) < zero();
            const Mask behind = q < load(packet_.q_lower + r);
            all_lose = all_lose & (outside | behind);
        }
        return all(all_lose);
    }

    /// A triangle against rays of a block of which not all certainly lose. A ray outside the
    /// triangle's rectangle does not hit it, and the bounds say nothing of it.
    HWY_NOINLINE void occlude(const Leaf& leaf, std::uint32_t block, std::uint32_t i) {
        const Setup& setup = setup_;
        const PointPlanes planes(setup, i);
        const FloatVec left = splat(setup.rectangles.lower_x[i]);
        const FloatVec right = splat(setup.rectangles.upper_x[i]);
        const FloatVec low = splat(setup.rectangles.lower_y[i]);
        const FloatVec high = splat(setup.rectangles.upper_y[i]);
        const auto rectangle_has = [](FloatVec v, FloatVec lower, FloatVec upper)
                                       HWY_ATTR { return (v >= lower) & (v <= upper); };
        bool any = false;
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec lower = load(packet_.q_lower + r);
            const FloatVec upper = lower * splat(kUpperByLower);
            const FloatVec x = load(packet_.x + r);
            const FloatVec y = load(packet_.y + r);
            const Mask inside = rectangle_has(x, left, right) & rectangle_has(y, low, high);
            const Position at(planes, x, y);
            Mask wins = inside & at.wins(planes, upper);
            const Mask open = and_not(wins | at.loses(planes, lower), inside);
            if (HWY_UNLIKELY(!none(open)))
                wins = wins | mask_of(ask_rule(r, leaf, i, bits_of(open)));
            any |= !none(wins);
            store(select(wins, splat(kDone), lower), packet_.q_lower + r);
        }
        if (any) find_point_depth(packet_, block);
    }

    /// Of some rays from r on, uncertain about a triangle: those that it occludes.
    HWY_NOINLINE std::uint32_t ask_rule(std::size_t r, const Leaf& leaf, std::uint32_t i,
                                        std::uint32_t lanes) const {
        FloatVec dir[3], tfar;
        if (HWY_LIKELY(r < kLightPacketRays)) {
            load_rays(packet_.rays[r / kBlockRays], r % kBlockRays, dir, tfar);
        } else {
            SharedOriginRays rays;
            const std::size_t place = r - kLightPacketRays;
            gather_rays(packet_, static_cast<std::uint32_t>(place - place % kBlockRays), rays);
            load_rays(rays, place % kBlockRays, dir, tfar);
        }
        lanes::TriangleHit hits;
        return bits_of(PacketRule(packet_.frame.org, dir)
                           .intersect(same_triangle(leaf, i), tfar, lanes, hits));
    }

    Packet& packet_;
    Setup setup_;
    std::uint32_t blocks_[kAllLightPacketBlocks + 15];
    std::uint32_t pairs_[kBlocksAtOnce * kLeafTriangles + 15];
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
