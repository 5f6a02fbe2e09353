// Any hits of a light packet in a leaf: its triangles against blocks of rays.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_LEAF_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_LEAF_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_LEAF_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "common/interop/packet_bounds.h"
#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/light/light_packet_blocks-inl.h"
#include "cpu/packet/light/light_packet_items-inl.h"
#include "cpu/packet/triangle_setup-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Appends the numbers of the bits of a mask, bit 0 being `first`, behind `count` numbers. Returns
/// how many numbers there are then. `numbers` has room for 15 more than are appended. Targets that
/// can compress a vector have no branch on the mask: the work on a number takes less time than a
/// mispredicted branch.
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

/// 1 / tfar in z lies between 1 - kEndError and 1 + kEndError times the computed value, so q_lower
/// times this is an upper bound of it: 2 kEndError, and 2^-20 for rounding.
inline constexpr float kUpperByLower = 1 + 2 * kEndError + 0x1p-20f;

/// Marks the rays of a packet that leaves occlude.
class LeafOcclusion {
public:
    explicit LeafOcclusion(LightPacket& packet) : packet_(packet) {}

    /// Tests a leaf, whose box is seen in a rectangle and no nearer than q, against some quads.
    HWY_INLINE void trace(const Leaf& leaf, const PlaneRectangle& rectangle, float q,
                          const QuadSet& quads) {
        std::size_t count = group_blocks(rectangle, q, quads);
        if (count <= kFewBlocks) count = keep_blocks(RaysWithin(packet_, rectangle, q));
        if (count == 0) return;
        const std::uint32_t alive = TriangleSetup<false>(packet_.frame).run(leaf, triangles_);
        const std::uint32_t unoriented = alive & triangles_.unoriented;
        const std::uint32_t oriented = alive & ~unoriented;
        const std::uint32_t one_by_one = triangles_for_many(oriented, count);
        if (one_by_one != oriented) {
            list_blocks();
            for (std::size_t begin = 0; begin < count; begin += kBlocksAtOnce) {
                const std::size_t end = std::min(begin + kBlocksAtOnce, count);
                trace_items(leaf, list_items(oriented & ~one_by_one, begin, end));
            }
        }
        if (one_by_one != 0) trace_triangles(leaf, one_by_one);
        if (HWY_UNLIKELY(unoriented != 0)) trace_unoriented(leaf, unoriented);
    }

private:
    /// The first quad of each group that has some, as bits.
    static HWY_INLINE std::uint64_t groups_of(std::uint64_t quads) {
        const std::uint64_t pairs = quads | quads >> 1;
        return (pairs | pairs >> 2) & 0x1111111111111111;
    }

    static constexpr std::size_t kBlocksAtOnce = 64;

    /// With more blocks than this, asking their rays costs more than it saves
    /// (lab/notes/cpu_tracer.md).
    static constexpr std::size_t kFewBlocks = 16;

    /// With more blocks than this for each triangle, triangles are taken one by one.
    static constexpr std::size_t kManyBlocks = 6;

    /// A triangle that meets more blocks than this is larger than they are, so that its edges
    /// exclude some.
    static constexpr std::size_t kManyOfTriangle = 8;

    /// Triangles that are taken one by one are listed until they have this many blocks.
    static constexpr std::size_t kListedBlocks = 256;

    /// The triangles that are taken one by one, as bits.
    HWY_INLINE std::uint32_t triangles_for_many(std::uint32_t oriented, std::size_t blocks) const {
        if (blocks > kManyBlocks * hwy::PopCount(oriented)) return oriented;
        return blocks > kManyOfTriangle ? oriented & triangles_.behind : 0;
    }

    /// Finds grouped_: the blocks of some quads that a rectangle and a hit at 1/z <= q may concern.
    /// Returns their number.
    HWY_INLINE std::size_t group_blocks(const PlaneRectangle& rectangle, float q,
                                        const QuadSet& quads) {
        const RectangleLanes own(rectangle);
        std::size_t count = 0;
        grouped_.groups = 0;
        for (std::uint32_t word = 0; word < 2; ++word) {
            for (std::uint64_t groups = groups_of(quads.words[word]); groups != 0;
                 groups &= groups - 1) {
                const std::uint32_t group =
                    (64 * word + static_cast<std::uint32_t>(__builtin_ctzll(groups))) /
                    (kGroupBlocks / kQuadBlocks);
                const std::uint32_t blocks = blocks_in(packet_, own, q, group);
                grouped_.groups |= (blocks != 0 ? 1u : 0u) << group;
                grouped_.of_group[group] = blocks;
                count += hwy::PopCount(blocks);
            }
        }
        return count;
    }

    /// Keeps the blocks of grouped_ that have such rays: blocks spread more widely than their rays
    /// lie. Returns their number.
    HWY_INLINE std::size_t keep_blocks(const RaysWithin& rays) {
        std::size_t count = 0;
        for (std::uint32_t rest = grouped_.groups; rest != 0; rest &= rest - 1) {
            const auto group = static_cast<std::uint32_t>(__builtin_ctz(rest));
            std::uint32_t kept = 0;
            for (std::uint32_t blocks = grouped_.of_group[group]; blocks != 0;
                 blocks &= blocks - 1) {
                const auto block = static_cast<std::uint32_t>(__builtin_ctz(blocks));
                if (rays.any_of_block(group * kGroupBlocks + block)) kept |= blocks & -blocks;
            }
            grouped_.of_group[group] = kept;
            if (kept == 0) grouped_.groups &= ~(rest & -rest);
            count += hwy::PopCount(kept);
        }
        return count;
    }

    /// Lists in blocks_ those of grouped_.
    HWY_INLINE void list_blocks() {
        std::size_t count = 0;
        for (std::uint32_t rest = grouped_.groups; rest != 0; rest &= rest - 1) {
            const auto group = static_cast<std::uint32_t>(__builtin_ctz(rest));
            count = append_bits(blocks_, count, group * kGroupBlocks, grouped_.of_group[group]);
        }
    }

    /// Lists in items_ the items of blocks_[begin, end) and the triangles that meet them. Returns
    /// their number.
    HWY_INLINE std::size_t list_items(std::uint32_t alive, std::size_t begin, std::size_t end) {
        std::size_t count = 0;
        for (std::size_t k = begin; k < end; ++k) {
            const std::uint32_t block = blocks_[k];
            count = append_bits(items_, count, block * kLeafTriangles,
                                alive & triangles_at(packet_, triangles_, block));
        }
        return count;
    }

    /// Traces the listed items. Most triangles belong to the surface that the rays end at, so the
    /// items that do not certainly miss are collected first.
    HWY_INLINE void trace_items(const Leaf& leaf, std::size_t count) {
        std::size_t uncertain = 0;
        for (std::size_t k = 0; k < count; ++k) {
            const std::uint32_t item = items_[k];
            items_[uncertain] = item;
            const MissPlanes planes(triangles_, item % kLeafTriangles);
            uncertain += certainly_misses(packet_, planes, item / kLeafTriangles) ? 0 : 1;
        }
        for (std::size_t k = 0; k < uncertain; ++k)
            occlude(leaf, items_[k] / kLeafTriangles, items_[k] % kLeafTriangles);
    }

    /// Blocks of each group.
    struct GroupedBlocks {
        std::uint32_t groups;  // those with blocks, as bits
        std::uint32_t of_group[kLightPacketGroups];
    };

    /// The bounds of all groups of grouped_.
    HWY_INLINE PlaneRectangle around_groups() const {
        PlaneRectangle r = PlaneRectangle::none();
        for (std::uint32_t rest = grouped_.groups; rest != 0; rest &= rest - 1)
            r.add(packet_.groups[static_cast<std::size_t>(__builtin_ctz(rest))]);
        return r;
    }

    /// Traces triangles one by one, each against all its blocks, so that its planes are read once.
    HWY_NOINLINE void trace_triangles(const Leaf& leaf, std::uint32_t alive) {
        alive &= triangles_through(triangles_, around_groups());
        while (alive != 0) alive = trace_some(leaf, alive);
    }

    /// Traces the first of some triangles, until these have kListedBlocks blocks. Returns the
    /// others. The blocks of all are listed before any is tested, so that no test waits for its
    /// block's number.
    HWY_INLINE std::uint32_t trace_some(const Leaf& leaf, std::uint32_t alive) {
        /// A triangle whose blocks end before blocks_[end].
        struct Listed {
            std::uint32_t triangle, end;
        };
        Listed listed[kLeafTriangles];
        std::size_t listed_count = 0;
        std::size_t count = 0;
        for (; alive != 0 && count <= kListedBlocks; alive &= alive - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(alive));
            count = list_blocks_of<true>(i, count);
            listed[listed_count++] = {i, static_cast<std::uint32_t>(count)};
        }
        std::size_t k = 0;
        for (std::size_t r = 0; r < listed_count; ++r) {
            const std::size_t begin = k;
            std::size_t uncertain = begin;
            const MissPlanes planes(triangles_, listed[r].triangle);
            for (; k < listed[r].end; ++k) {
                const std::uint32_t block = blocks_[k];
                blocks_[uncertain] = block;
                uncertain += certainly_misses(packet_, planes, block) ? 0 : 1;
            }
            for (std::size_t m = begin; m < uncertain; ++m)
                occlude(leaf, blocks_[m], listed[r].triangle);
        }
        return alive;
    }

    /// Traces unoriented triangles one by one.
    HWY_NOINLINE void trace_unoriented(const Leaf& leaf, std::uint32_t unoriented) {
        unoriented &= triangles_through(triangles_, around_groups());
        for (; unoriented != 0; unoriented &= unoriented - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(unoriented));
            const std::size_t count = list_blocks_of<false>(i, 0);
            for (std::size_t k = 0; k < count; ++k) occlude_unoriented(leaf, blocks_[k], i);
        }
    }

    /// Lists in blocks_, behind `count` others, those of grouped_ that triangle i meets. Returns
    /// how many there are then.
    template <bool kOriented>
    HWY_INLINE std::size_t list_blocks_of(std::uint32_t i, std::size_t count) {
        const RectangleLanes rectangle(triangles_.rectangles[i]);
        const float q = triangles_.q[i];
        const Outline<kOriented> outline(triangles_, i);
        const std::uint32_t groups = grouped_.groups & groups_through(packet_, outline, rectangle);
        std::uint32_t of_group[kLightPacketGroups];
        std::size_t found = 0;
        for (std::uint32_t rest = groups; rest != 0; rest &= rest - 1) {
            const auto group = static_cast<std::uint32_t>(__builtin_ctz(rest));
            of_group[group] = grouped_.of_group[group] & blocks_in(packet_, rectangle, q, group);
            if constexpr (kOriented) of_group[group] &= blocks_reaching(packet_, outline, group);
            found += hwy::PopCount(of_group[group]);
        }
        const bool by_edges = !kOriented || found > kManyOfTriangle;
        for (std::uint32_t rest = groups; rest != 0; rest &= rest - 1) {
            const auto group = static_cast<std::uint32_t>(__builtin_ctz(rest));
            std::uint32_t blocks = of_group[group];
            if (by_edges) blocks &= blocks_through(packet_, outline, group);
            count = append_bits(blocks_, count, group * kGroupBlocks, blocks);
        }
        return count;
    }

    /// Marks the rays of a block that triangle i occludes. A ray outside the triangle's rectangle
    /// does not hit it; the bounds do not hold there.
    HWY_NOINLINE void occlude(const Leaf& leaf, std::uint32_t block, std::uint32_t i) {
        const LightPlanes planes(triangles_, i);
        const RectangleLanes rectangle(triangles_.rectangles[i]);
        bool any = false;
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec lower = load(packet_.q_lower + r);
            const FloatVec upper = lower * splat(kUpperByLower);
            const FloatVec x = load(packet_.x + r);
            const FloatVec y = load(packet_.y + r);
            const Mask in_rectangle = rectangle.holds(x, y);
            const Position at(planes, x, y);
            Mask occluded = in_rectangle & at.is_closer(planes, upper);
            const Mask uncertain = and_not(occluded | at.is_rejected(planes, lower), in_rectangle);
            if (HWY_UNLIKELY(!none(uncertain)))
                occluded = occluded | mask_of(resolve(r, leaf, i, bits_of(uncertain)));
            any |= !none(occluded);
            store(select(occluded, splat(kDone), lower), packet_.q_lower + r);
        }
        if (any) update_depth(packet_, block);
    }

    /// Marks the rays of a block that the unoriented triangle i occludes.
    HWY_INLINE void occlude_unoriented(const Leaf& leaf, std::uint32_t block, std::uint32_t i) {
        const Planes planes(triangles_, i);
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec lower = load(packet_.q_lower + r);
            const Mask uncertain = planes.may_be_inside(load(packet_.x + r), load(packet_.y + r)) &
                                   (lower < splat(kDone));
            if (HWY_LIKELY(none(uncertain))) continue;
            const Mask occluded = mask_of(resolve(r, leaf, i, bits_of(uncertain)));
            if (none(occluded)) continue;
            store(select(occluded, splat(kDone), lower), packet_.q_lower + r);
            update_depth(packet_, block);
        }
    }

    /// Asks the rule about triangle i and uncertain rays, `lanes` from r on. Returns those that it
    /// occludes, as bits.
    HWY_NOINLINE std::uint32_t resolve(std::size_t r, const Leaf& leaf, std::uint32_t i,
                                       std::uint32_t lanes) const {
        FloatVec dir[3], tfar;
        load_rays(rays_of(packet_, r / kBlockRays), r % kBlockRays, dir, tfar);
        lanes::TriangleHit hits;
        const lanes::ShearedRay rays =
            lanes::shear_ray(lanes::Float3(packet_.frame.org), lanes::Float3(dir));
        return bits_of(intersect_triangles(rays, same_triangle(leaf, i), tfar, lanes, hits));
    }

    LightPacket& packet_;
    LightTriangles triangles_;
    GroupedBlocks grouped_;
    std::uint32_t blocks_[kListedBlocks + kAllLightPacketBlocks + 15];
    std::uint32_t items_[kBlocksAtOnce * kLeafTriangles + 15];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
