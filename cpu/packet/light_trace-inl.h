// Any hits of a light packet: blocks and quads; a triangle at a block's rays; edges of triangles
// against bounds of many rays; a leaf against blocks; and the tree, where the active rays at a node
// are a set of quads.
#include <algorithm>
#include <cmath>

#include "cpu/packet/light_packet-inl.h"
#include "cpu/packet/triangle_setup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Blocks and quads

/// The blocks of a group with rays that may lie in a rectangle and that a hit at 1/z <= q may
/// concern, as bits.
HWY_INLINE std::uint32_t blocks_in(const LightPacket& packet, const RectangleLanes& rectangle,
                                   float q, std::uint32_t group) {
    return bits_of_sixteen([&](std::size_t l) HWY_ATTR {
        const std::size_t b = group * kGroupBlocks + l;
        const Mask near = splat(q) >= load(packet.block_q + b);
        return near & rectangle.meets(RectangleLanes(packet.blocks, b));
    });
}

/// Quads of a packet as bits: the first word has quads in place, the second quads of regrouped
/// blocks.
struct QuadSet {
    std::uint64_t words[2];

    HWY_INLINE bool any() const { return (words[0] | words[1]) != 0; }
    HWY_INLINE std::size_t count() const {
        return hwy::PopCount(words[0]) + hwy::PopCount(words[1]);
    }
};

/// With more quads than this, comparing each, and its rays, with a box costs more than it saves
/// (lab/notes/cpu_tracer.md).
inline constexpr std::size_t kFewQuads = 8;

/// The quads of `among` for which is_met(k) has a lane: it tests as many as there are lanes, from
/// k on.
template <class IsMet>
HWY_INLINE QuadSet find_quads(const LightPacket& packet, const QuadSet& among, IsMet is_met) {
    QuadSet quads = {};
    const auto find = [&](std::uint32_t word, std::size_t count) HWY_ATTR {
        for (std::size_t l = 0; l < count; l += kLanes)
            quads.words[word] |= std::uint64_t{bits_of(is_met(64 * word + l))} << l;
        quads.words[word] &= among.words[word];
    };
    find(0, kLightPacketQuads / 2);
    if (packet.regrouped_count != 0)
        find(1, (packet.regrouped_count + kQuadBlocks - 1) / kQuadBlocks);
    return quads;
}

/// The quads of `among` that a rectangle and a hit at 1/z <= q may concern.
HWY_INLINE QuadSet quads_in(const LightPacket& packet, const RectangleLanes& rectangle, float q,
                            const QuadSet& among) {
    return find_quads(packet, among, [&](std::size_t k) HWY_ATTR {
        const Mask near = splat(q) >= load(packet.quad_q + k);
        return near & rectangle.meets(RectangleLanes(packet.quads, k));
    });
}

/// Sets quads_of[slot] to the quads of `among` that rectangle `slot` and a hit at 1/z <= q[slot]
/// may concern, for the slots of `slots`. Returns the slots that have some. For few quads: each is
/// compared with all rectangles at once.
HWY_INLINE std::uint32_t few_quads_in(const LightPacket& packet, const Rectangles& r,
                                      const float* q, std::uint32_t slots, const QuadSet& among,
                                      QuadSet* quads_of) {
    for (const std::uint32_t slot : BitsOf(slots)) quads_of[slot] = {};
    std::uint32_t kept = 0;
    for (std::uint32_t word = 0; word < 2; ++word) {
        for (const std::uint32_t bit : BitsOf(among.words[word])) {
            const std::size_t k = 64 * word + bit;
            const RectangleLanes quad(packet.quads[k]);
            const FloatVec quad_q = splat(packet.quad_q[k]);
            const std::uint32_t met = slots & bits_of_sixteen([&](std::size_t l) HWY_ATTR {
                                          const Mask near = load(q + l) >= quad_q;
                                          return near & RectangleLanes(r, l).meets(quad);
                                      });
            kept |= met;
            for (const std::uint32_t slot : BitsOf(met))
                quads_of[slot].words[word] |= std::uint64_t{1} << bit;
        }
    }
    return kept;
}

/// A packet is given up if its quads cover their bounds more often than this
/// (lab/notes/cpu_tracer.md).
inline constexpr float kMostOverlap = 8;

/// Whether quads lie over each other, so that most boxes concern many of them but few rays.
HWY_INLINE bool quads_overlap(const LightPacket& packet) {
    FloatVec area = zero();
    for (std::size_t k = 0; k < kLightPacketQuads; k += kLanes) {
        const Mask has_rays = load(packet.quad_q + k) < splat(kDone);
        const RectangleLanes quad(packet.quads, k);
        const FloatVec width = quad.upper_x - quad.lower_x;
        const FloatVec height = quad.upper_y - quad.lower_y;
        area = area + zero_unless(has_rays, width * height);
    }
    const PacketFrame& frame = packet.frame;
    return hn::GetLane(hn::SumOfLanes(kFloats, area)) >
           kMostOverlap * (frame.upper_x - frame.lower_x) * (frame.upper_y - frame.lower_y);
}

/// The rays that lie in a rectangle and that a hit at 1/z <= q may concern.
class RaysWithin {
public:
    HWY_INLINE RaysWithin(const LightPacket& packet, const PlaneRectangle& rectangle, float q)
        : packet_(packet), rectangle_(rectangle), q_(splat(q)) {}

    HWY_INLINE bool any_of_block(std::size_t block) const {
        Mask found = at(block * kBlockRays);
        for (std::size_t l = kLanes; l < kBlockRays; l += kLanes)
            found = found | at(block * kBlockRays + l);
        return !none(found);
    }

    HWY_INLINE QuadSet quads(const QuadSet& among) const {
        QuadSet kept = {};
        for (std::uint32_t word = 0; word < 2; ++word) {
            for (const std::uint32_t bit : BitsOf(among.words[word])) {
                const std::size_t first = (64 * word + bit) * kQuadBlocks;
                if (any_of_block(first) || any_of_block(first + 1) || any_of_block(first + 2) ||
                    any_of_block(first + 3))
                    kept.words[word] |= std::uint64_t{1} << bit;
            }
        }
        return kept;
    }

private:
    /// Tests as many rays as there are lanes, from r on.
    HWY_INLINE Mask at(std::size_t r) const {
        return (load(packet_.q_lower + r) <= q_) &
               rectangle_.holds(load(packet_.x + r), load(packet_.y + r));
    }

    const LightPacket& packet_;
    RectangleLanes rectangle_;
    FloatVec q_;
};

// ---- Items

/// The triangles of a leaf whose rectangle meets a block and that are near enough for it, as bits.
HWY_INLINE std::uint32_t triangles_at(const LightPacket& packet, const LightTriangles& triangles,
                                      std::uint32_t block) {
    const RectangleLanes own(packet.blocks[block]);
    const FloatVec q = splat(packet.block_q[block]);
    return bits_of_sixteen([&](std::size_t l) HWY_ATTR {
        const Mask near = load(triangles.q + l) >= q;
        return near & RectangleLanes(triangles.rectangles, l).meets(own);
    });
}

/// Whether all rays of a block certainly miss a triangle or hit it beyond their limits. It decides
/// less than occlude() but costs less, since its constants are found once a leaf: p has most_c,
/// with the bounds of edge functions and of 1/z, and all roundings (lab/proofs/packet_any.g). A ray
/// outside the triangle's rectangle, of which the bounds say nothing, misses.
HWY_INLINE bool certainly_misses(const LightPacket& packet, const Planes& p, std::uint32_t block) {
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

// ---- Edges

/// Rectangles of the plane, by their middles and half extents.
struct MiddleRectangles {
    HWY_INLINE explicit MiddleRectangles(const RectangleLanes& r)
        : x(splat(0.5f) * (r.lower_x + r.upper_x)),
          y(splat(0.5f) * (r.lower_y + r.upper_y)),
          half_x(splat(0.5f) * (r.upper_x - r.lower_x)),
          half_y(splat(0.5f) * (r.upper_y - r.lower_y)) {}

    FloatVec x, y, half_x, half_y;
};

/// An edge of triangles against rectangles that are the bounds of blocks or of groups; a triangle
/// and a rectangle a lane. `highest` is an upper bound of the edge function plus its bound over a
/// rectangle, `lowest` of its negative plus the bound: if less than -kBlockBound * bound, the
/// function is certainly below -bound, or above bound, for all rays there
/// (lab/proofs/packet_any.g).
struct EdgeRange {
    FloatVec a, b, most_c, most_minus_c;

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

/// The edges and the plane of triangles against rectangles; a triangle and a rectangle a lane.
class Outline {
public:
    /// at(values): a vector of the triangles' values, from those of a leaf.
    template <class At>
    HWY_INLINE Outline(const LightTriangles& t, At at) {
        const FloatVec bound = at(t.bound);
        limit_ = splat(-kBlockBound) * bound;
        for (int k = 0; k < 4; ++k) {
            planes_[k] = {at(t.a[k]), at(t.b[k]), at(t.most_c[k]),
                          splat(kMissBound) * bound - at(t.c[k])};
        }
        EdgeRange& depth = planes_[kDepthPlane];
        depth.most_c = depth.most_c + splat(kBlockGradient) * (abs(depth.a) + abs(depth.b));
    }

    /// The blocks whose rays all end before they reach the triangle: block_q is the least 1/z of
    /// their ends. kBlockGradient covers what is rounded here (lab/proofs/packet_any.g).
    HWY_INLINE Mask is_beyond(const MiddleRectangles& r, FloatVec block_q) const {
        return planes_[kDepthPlane].highest(r) < block_q;
    }

    /// The rectangles for which an edge function is below its bound, or above it: no ray hits an
    /// oriented triangle where one is below, another one where both are true.
    HWY_INLINE Mask is_below(const MiddleRectangles& r) const {
        return min3(planes_[0].highest(r), planes_[1].highest(r), planes_[2].highest(r)) < limit_;
    }
    HWY_INLINE Mask is_above(const MiddleRectangles& r) const {
        return min3(planes_[0].lowest(r), planes_[1].lowest(r), planes_[2].lowest(r)) < limit_;
    }
    template <bool kOriented>
    HWY_INLINE Mask excludes(const MiddleRectangles& r) const {
        if constexpr (kOriented) return is_below(r);
        return is_below(r) & is_above(r);
    }

private:
    EdgeRange planes_[4];
    FloatVec limit_;
};

/// The triangles of a leaf that their edges do not exclude from a rectangle, as bits.
HWY_INLINE std::uint32_t triangles_through(const LightTriangles& triangles,
                                           const PlaneRectangle& rectangle) {
    const MiddleRectangles r{RectangleLanes(rectangle)};
    std::uint32_t below = 0;
    std::uint32_t above = 0;
    for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
        const Outline some(triangles,
                           [l](const PerTriangle<float>& v) HWY_ATTR { return load(v + l); });
        below |= bits_of(some.is_below(r)) << l;
        above |= bits_of(some.is_above(r)) << l;
    }
    return ~(below & (above | ~triangles.unoriented));
}

/// The blocks of a group that reach an oriented triangle, or may, as bits.
HWY_INLINE std::uint32_t blocks_reaching(const LightPacket& packet, const Outline& outline,
                                         std::uint32_t group) {
    return bits_of_sixteen([&](std::size_t l) HWY_ATTR {
        const std::size_t block = group * kGroupBlocks + l;
        const MiddleRectangles own(RectangleLanes(packet.blocks, block));
        return !outline.is_beyond(own, load(packet.block_q + block));
    });
}

/// The blocks of a group that an outline does not exclude, as bits.
template <bool kOriented>
HWY_INLINE std::uint32_t blocks_through(const LightPacket& packet, const Outline& outline,
                                        std::uint32_t group) {
    return bits_of_sixteen([&](std::size_t l) HWY_ATTR {
        const RectangleLanes own(packet.blocks, group * kGroupBlocks + l);
        return !outline.excludes<kOriented>(MiddleRectangles(own));
    });
}

/// The groups that meet a rectangle and that an outline does not exclude, as bits.
template <bool kOriented>
HWY_INLINE std::uint32_t groups_through(const LightPacket& packet, const Outline& outline,
                                        const RectangleLanes& rectangle) {
    std::uint32_t through = 0;
    const std::size_t end =
        packet.regrouped_count == 0 ? kLightPacketGroups / 2 : kLightPacketGroups;
    for (std::size_t l = 0; l < end; l += kLanes) {
        const RectangleLanes own(packet.groups, l);
        const Mask outside = outline.excludes<kOriented>(MiddleRectangles(own));
        through |= bits_of(and_not(outside, rectangle.meets(own))) << l;
    }
    return through;
}

// ---- Leaves

/// Appends the numbers of the bits of a mask, bit 0 being `first`, behind `count` numbers. Returns
/// how many there are then. `numbers` can hold 15 more. Targets that can compress a vector need no
/// branch on the mask, which would be mispredicted.
HWY_INLINE std::size_t append_bits(std::uint32_t* numbers, std::size_t count, std::uint32_t first,
                                   std::uint32_t mask) {
#if HWY_TARGET <= HWY_AVX3
    const UintVec all = hn::Iota(kUints, 0) + splat(first);
    store_unaligned(hn::Compress(all, uint_mask(mask_of(mask))), numbers + count);
    return count + hwy::PopCount(mask);
#else
    for (const std::uint32_t bit : BitsOf(mask)) numbers[count++] = first + bit;
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
        std::uint32_t one_by_one = count > kManyOfTriangle ? oriented & triangles_.behind : 0;
        if (count > kManyBlocks * hwy::PopCount(oriented)) one_by_one = oriented;
        if (one_by_one != oriented) {
            std::size_t listed = 0;
            for (const std::uint32_t group : BitsOf(grouped_.groups))
                listed =
                    append_bits(blocks_, listed, group * kGroupBlocks, grouped_.of_group[group]);
            for (std::size_t begin = 0; begin < count; begin += kBlocksAtOnce) {
                const std::size_t end = std::min(begin + kBlocksAtOnce, count);
                trace_items(leaf, list_items(oriented & ~one_by_one, begin, end));
            }
        }
        if (one_by_one != 0) trace_triangles(leaf, one_by_one);
        if (HWY_UNLIKELY(unoriented != 0)) trace_unoriented(leaf, unoriented);
    }

private:
    static constexpr std::size_t kBlocksAtOnce = 64;

    /// With more blocks than this, testing their rays costs more than it saves
    /// (lab/notes/cpu_tracer.md).
    static constexpr std::size_t kFewBlocks = 16;

    /// With more blocks than this for each triangle, triangles are taken one by one.
    static constexpr std::size_t kManyBlocks = 6;

    /// A triangle that meets more blocks than this is larger than they are, so that its edges
    /// exclude some.
    static constexpr std::size_t kManyOfTriangle = 8;

    /// Triangles that are taken one by one are listed until they have this many blocks.
    static constexpr std::size_t kListedBlocks = 256;

    /// Finds grouped_: the blocks of some quads that a rectangle and a hit at 1/z <= q may concern.
    /// Returns their number.
    HWY_INLINE std::size_t group_blocks(const PlaneRectangle& rectangle, float q,
                                        const QuadSet& quads) {
        const RectangleLanes own(rectangle);
        std::size_t count = 0;
        grouped_.groups = 0;
        for (std::uint32_t word = 0; word < 2; ++word) {
            // The first quad of each group that has some.
            const std::uint64_t pairs = quads.words[word] | quads.words[word] >> 1;
            const std::uint64_t groups = (pairs | pairs >> 2) & 0x1111111111111111;
            for (const std::uint32_t quad : BitsOf(groups)) {
                const std::uint32_t group = (64 * word + quad) / (kGroupBlocks / kQuadBlocks);
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
        for (const std::uint32_t group : BitsOf(grouped_.groups)) {
            std::uint32_t kept = 0;
            for (const std::uint32_t block : BitsOf(grouped_.of_group[group]))
                if (rays.any_of_block(group * kGroupBlocks + block)) kept |= 1u << block;
            grouped_.of_group[group] = kept;
            if (kept == 0) grouped_.groups &= ~(1u << group);
            count += hwy::PopCount(kept);
        }
        return count;
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
            const Planes planes(triangles_, item % kLeafTriangles, triangles_.most_c);
            uncertain += certainly_misses(packet_, planes, item / kLeafTriangles) ? 0 : 1;
        }
        for (std::size_t k = 0; k < uncertain; ++k)
            occlude(leaf, items_[k] / kLeafTriangles, items_[k] % kLeafTriangles);
    }

    struct GroupedBlocks {
        std::uint32_t groups;  // those with blocks, as bits
        std::uint32_t of_group[kLightPacketGroups];
    };

    HWY_INLINE PlaneRectangle around_groups() const {
        PlaneRectangle r = PlaneRectangle::none();
        for (const std::uint32_t group : BitsOf(grouped_.groups)) r.add(packet_.groups[group]);
        return r;
    }

    /// Traces triangles one by one, each against all its blocks, so that its planes are read once.
    HWY_NOINLINE void trace_triangles(const Leaf& leaf, std::uint32_t alive) {
        alive &= triangles_through(triangles_, around_groups());
        while (alive != 0) alive = trace_some(leaf, alive);
    }

    /// Traces the first of some triangles, until these have kListedBlocks blocks. Returns the
    /// others. All blocks are listed first, so that no test waits for its block's number.
    HWY_INLINE std::uint32_t trace_some(const Leaf& leaf, std::uint32_t alive) {
        /// A triangle whose blocks end before blocks_[end].
        struct Listed {
            std::uint32_t triangle, end;
        };
        PerTriangle<Listed> listed;
        std::size_t listed_count = 0;
        std::size_t count = 0;
        for (; alive != 0 && count <= kListedBlocks; alive &= alive - 1) {
            const std::uint32_t i = first_bit(alive);
            count = list_blocks_of<true>(i, count);
            listed[listed_count++] = {i, static_cast<std::uint32_t>(count)};
        }
        std::size_t k = 0;
        for (std::size_t r = 0; r < listed_count; ++r) {
            const std::size_t begin = k;
            std::size_t uncertain = begin;
            const Planes planes(triangles_, listed[r].triangle, triangles_.most_c);
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

    HWY_NOINLINE void trace_unoriented(const Leaf& leaf, std::uint32_t unoriented) {
        unoriented &= triangles_through(triangles_, around_groups());
        for (const std::uint32_t i : BitsOf(unoriented)) {
            const std::size_t count = list_blocks_of<false>(i, 0);
            for (std::size_t k = 0; k < count; ++k) occlude_unoriented(leaf, blocks_[k], i);
        }
    }

    /// Lists in blocks_, behind `count` others, the blocks of grouped_ that triangle i meets.
    /// Returns how many there are then.
    template <bool kOriented>
    HWY_INLINE std::size_t list_blocks_of(std::uint32_t i, std::size_t count) {
        const RectangleLanes rectangle(triangles_.rectangles[i]);
        const float q = triangles_.q[i];
        const Outline outline(triangles_,
                              [i](const PerTriangle<float>& v) HWY_ATTR { return splat(v[i]); });
        const std::uint32_t groups =
            grouped_.groups & groups_through<kOriented>(packet_, outline, rectangle);
        std::uint32_t of_group[kLightPacketGroups];
        std::size_t found = 0;
        for (const std::uint32_t group : BitsOf(groups)) {
            of_group[group] = grouped_.of_group[group] & blocks_in(packet_, rectangle, q, group);
            if constexpr (kOriented) of_group[group] &= blocks_reaching(packet_, outline, group);
            found += hwy::PopCount(of_group[group]);
        }
        const bool by_edges = !kOriented || found > kManyOfTriangle;
        for (const std::uint32_t group : BitsOf(groups)) {
            std::uint32_t blocks = of_group[group];
            if (by_edges) blocks &= blocks_through<kOriented>(packet_, outline, group);
            count = append_bits(blocks_, count, group * kGroupBlocks, blocks);
        }
        return count;
    }

    /// Marks the rays of a block that triangle i occludes. A ray outside the triangle's rectangle
    /// does not hit it; the bounds do not hold there. Overflow can make a NaN, which decides
    /// nothing.
    HWY_NOINLINE void occlude(const Leaf& leaf, std::uint32_t block, std::uint32_t i) {
        const Planes planes(triangles_, i);
        const FloatVec error0 = splat(triangles_.c0[i]), error1 = splat(triangles_.c1[i]);
        const FloatVec error2 = splat(triangles_.c2[i]);
        const RectangleLanes rectangle(triangles_.rectangles[i]);
        bool any = false;
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec lower = load(packet_.q_lower + r);
            const FloatVec upper = lower * splat(kUpperByLower);
            const FloatVec x = load(packet_.x + r);
            const FloatVec y = load(packet_.y + r);
            const Mask in_rectangle = rectangle.holds(x, y);
            const FloatVec least = planes.least_edge(x, y);
            const FloatVec q = planes.depth(x, y);
            const FloatVec error = mul_add(q, mul_add(q, error2, error1), error0);
            const FloatVec most_q = q + error;
            // Where the triangle is so far away that most_q holds.
            const Mask is_far = most_q * error2 <= splat(kFarDepth);
            Mask occluded = in_rectangle & ((least > planes.bound) & (q - error > upper));
            const Mask is_rejected = (least < -planes.bound) | (is_far & (most_q < lower));
            const Mask uncertain = and_not(occluded | is_rejected, in_rectangle);
            if (HWY_UNLIKELY(!none(uncertain)))
                occluded = occluded | mask_of(resolve(r, leaf, i, bits_of(uncertain)));
            any |= !none(occluded);
            store(select(occluded, splat(kDone), lower), packet_.q_lower + r);
        }
        if (any) update_depth(packet_, block);
    }

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

    /// Applies the hit rule to triangle i and uncertain rays, `lanes` from r on. Returns the rays
    /// that it occludes, as bits.
    HWY_NOINLINE std::uint32_t resolve(std::size_t r, const Leaf& leaf, std::uint32_t i,
                                       std::uint32_t lanes) const {
        FloatVec dir[3], tfar;
        const std::size_t block = r / kBlockRays;
        load_rays(block < kLightPacketBlocks ? packet_.rays[block]
                                             : packet_.regrouped[block - kLightPacketBlocks],
                  r % kBlockRays, dir, tfar);
        lanes::TriangleHit hits;
        const lanes::ShearedRay rays =
            lanes::shear_ray(lanes::Float3(packet_.frame.org), lanes::Float3(dir));
        return bits_of(intersect_triangles(rays, mask_of(lanes), {zero(), tfar},
                                           corners_in_lanes(leaf, i), hits));
    }

    LightPacket& packet_;
    LightTriangles triangles_;
    GroupedBlocks grouped_;
    std::uint32_t blocks_[kListedBlocks + kAllLightPacketBlocks + 15];
    std::uint32_t items_[kBlocksAtOnce * kLeafTriangles + 15];
};

// ---- The tree

/// Marks the occluded rays of a packet as done. A quad takes one comparison with a box instead of
/// four for its blocks, which only leaves test. Boxes that concern few quads are compared with
/// their rays, too: most lie between the rays where the light sees small triangles.
class alignas(kPage) LightPacketTracer {
public:
    /// The quads that a box may concern, and the rectangle that the box is seen in.
    struct ActiveRays {
        QuadSet quads;
        PlaneRectangle rectangle;
    };

    explicit LightPacketTracer(LightPacket& packet) : packet_(packet), occlusion_(packet) {}

    static ActiveRays all() { return {{{kAllBlocks, kAllBlocks}}, PlaneRectangle::whole()}; }
    const PacketFrame& frame() const { return packet_.frame; }

    HWY_INLINE bool narrow(float q, bool is_node, ActiveRays& active) const {
        active.quads = find_quads(packet_, active.quads, [&](std::size_t k) HWY_ATTR {
            return splat(q) >= load(packet_.quad_q + k);
        });
        if (is_node && active.quads.count() <= kFewQuads)
            active.quads = RaysWithin(packet_, active.rectangle, q).quads(active.quads);
        return active.quads.any();
    }

    HWY_INLINE std::uint32_t find_active(const NodeChildren& children, std::uint32_t slots,
                                         const ActiveRays& active, ActiveRays* active_at) const {
        const Rectangles& r = children.rectangles;
        PerSlot<QuadSet> quads_of;
        std::uint32_t kept = 0;
        if (active.quads.count() <= kFewQuads) {
            kept = few_quads_in(packet_, r, children.q, slots, active.quads, quads_of);
        } else {
            for (const std::uint32_t slot : BitsOf(slots)) {
                const RectangleLanes box(r[slot]);
                quads_of[slot] = quads_in(packet_, box, children.q[slot], active.quads);
                kept |= (quads_of[slot].any() ? 1u : 0u) << slot;
            }
        }
        for (const std::uint32_t slot : BitsOf(kept)) active_at[slot] = {quads_of[slot], r[slot]};
        return kept;
    }

    HWY_INLINE bool visit_leaf(const Leaf& leaf, float q, const ActiveRays& active) {
        occlusion_.trace(leaf, active.rectangle, q, active.quads);
        return true;
    }

private:
    LightPacket& packet_;
    LeafOcclusion occlusion_;
};

HWY_INLINE void trace_light_packet(const Bvh& bvh, LightPacket& packet) {
    LightPacketTracer tracer(packet);
    PacketTraversal<LightPacketTracer> traversal(bvh, tracer);
    if (traversal.start(LightPacketTracer::all())) traversal.run();
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
