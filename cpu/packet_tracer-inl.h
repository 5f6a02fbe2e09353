// Packets of rays with a common origin against the shared layout, written once for every width of
// vector.
//
// Based on: I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes Using Dynamic Bounding
// Volume Hierarchies. ACM TOG 26(1), 2007: packets far larger than a vector, one conservative test
// of the whole packet a node, ordered descent. Changed: sixteen children are tested at once in the
// packet's own projection; what is left of the packet is a mask of blocks, culled by depth block by
// block; and triangles are set up sixteen at a time as homogeneous edge functions (M. Olano, T.
// Greer. Triangle scan conversion using 2D homogeneous coordinates. 1997), so that no vertex beside
// or behind the eye needs clipping.
//
// Nothing here decides a hit. The edge functions and 1/z carry a bound of their distance from what
// the hit rule (common/interop/triangle.h) computes; where the bound leaves no doubt they stand for
// the rule, and where it leaves one, the rule itself is asked. So any arithmetic may be used, fused
// or not.

#if defined(MORPHRAY_PACKET_TRACER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_PACKET_TRACER_INL_H
#undef MORPHRAY_PACKET_TRACER_INL_H
#else
#define MORPHRAY_PACKET_TRACER_INL_H
#endif

#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "common/bvh.h"
#include "common/interop/triangle.h"
#include "cpu/packet.h"
#include "cpu/packet_blocks-inl.h"
#include "cpu/packet_rule-inl.h"
#include "cpu/packet_setup-inl.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What a traversal has still to visit.
struct Entry {
    float q;  // nearest_q of the box
    std::uint32_t child;
    std::uint64_t blocks;
};

enum class Query { kClosest, kAny };

/// Closest hits are wanted of cameras, whose blocks lie on a grid; any hits of rays from a light,
/// which lie anywhere.
template <Query kQuery>
class PacketTraversal {
public:
    PacketTraversal(const Bvh& bvh, Packet& packet)
        : bvh_(bvh), packet_(packet), frame_(packet.frame) {}

    /// Visits the root, which needs the packet's bounds alone. Whether there is anything to go on
    /// with.
    bool start() {
        visit_node({kAnyDepth, 0, ~std::uint64_t{0}}, stack_, size_);
        return size_ > 0;
    }

    void run() {
        Entry* stack = stack_;
        std::uint32_t& size = size_;
        while (size > 0) {
            Entry entry = stack[--size];
            entry.blocks &= blocks_beyond(packet_, entry.q);
            if (entry.blocks == 0) continue;
            if ((entry.child & kLeafBit) == 0) {
                visit_node(entry, stack, size);
            } else {
                visit_leaf(entry.child & ~kLeafBit, entry.blocks);
            }
        }
    }

private:
    static constexpr std::size_t kCacheLine = 64;
    /// Pairs of a triangle and a block that are traced rather than first looked at together.
    static constexpr std::size_t kFew = 4;
    static constexpr bool kOnGrid = kQuery == Query::kClosest;

    HWY_INLINE std::uint64_t blocks_of(const Rectangles& rectangles, const GridRanges& ranges,
                                       std::uint32_t i) const {
        return kOnGrid ? blocks_of_grid(ranges, i) : blocks_in(packet_, rectangles, i);
    }

    /// Least and greatest of row k of the projection over boxes given relative to the origin.
    /// In units of 2^-24 of row_size times the largest coordinate, products and sums are off by at
    /// most 5, and the triangles that the rule sees reach out of their boxes by at most 8 (2^-22 of
    /// a vertex's distance from the ray, at most twice that coordinate): 16 on both sides.
    HWY_INLINE void project_boxes(int k, const VF lower[3], const VF upper[3], VF size, VF& least,
                                  VF& most) const {
        least = hn::Zero(Floats());
        most = hn::Zero(Floats());
        for (int axis = 0; axis < 3; ++axis) {
            const float row = frame_.rows_f[k][axis];
            least = hn::MulAdd(splat(row), row >= 0 ? lower[axis] : upper[axis], least);
            most = hn::MulAdd(splat(row), row >= 0 ? upper[axis] : lower[axis], most);
        }
        const VF error = hn::Mul(splat(0x1p-20f * frame_.row_size[k]), size);
        least = hn::Sub(least, error);
        most = hn::Add(most, error);
    }

    void visit_node(const Entry& entry, Entry* stack, std::uint32_t& size) const {
        const Floats f;
        const Node& node = bvh_.nodes[entry.child];
        Rectangles rectangles;
        GridRanges ranges;
        alignas(64) float q[16];
        std::uint32_t hits = 0;
        for (std::size_t l = 0; l < kWidth; l += hn::Lanes(f)) {
            const VF org[3] = {splat(frame_.org.x), splat(frame_.org.y), splat(frame_.org.z)};
            const VF lower[3] = {hn::Sub(hn::LoadU(f, node.lower_x + l), org[0]),
                                 hn::Sub(hn::LoadU(f, node.lower_y + l), org[1]),
                                 hn::Sub(hn::LoadU(f, node.lower_z + l), org[2])};
            const VF upper[3] = {hn::Sub(hn::LoadU(f, node.upper_x + l), org[0]),
                                 hn::Sub(hn::LoadU(f, node.upper_y + l), org[1]),
                                 hn::Sub(hn::LoadU(f, node.upper_z + l), org[2])};
            VF largest = hn::Zero(f);
            for (int axis = 0; axis < 3; ++axis) {
                largest = hn::Max(largest, hn::Max(hn::Abs(lower[axis]), hn::Abs(upper[axis])));
            }
            VF least[3], most[3];
            for (int k = 0; k < 3; ++k) project_boxes(k, lower, upper, largest, least[k], most[k]);
            const Mask keep = rectangle_of_box(least, most, rectangles, l);
            hn::Store(nearest_q(hn::Sub(least[2], splat(frame_.depth_error))), f, q + l);
            hits |= mask_bits(keep) << l;
        }
        if constexpr (kOnGrid) to_grid(rectangles, frame_.grid_margin, ranges);
        const std::uint32_t base = size;
        for (; hits != 0; hits &= hits - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(hits));
            if (node.child[slot] == kEmptyChild) break;
            const std::uint64_t blocks = entry.blocks & blocks_of(rectangles, ranges, slot) &
                                         blocks_beyond(packet_, q[slot]);
            if (blocks == 0) continue;
            std::uint32_t place = size++;
            for (; place > base && stack[place - 1].q > q[slot]; --place)
                stack[place] = stack[place - 1];
            stack[place] = {q[slot], node.child[slot], blocks};
            prefetch(node.child[slot]);
        }
    }

    void prefetch(std::uint32_t child) const {
        const bool is_leaf = (child & kLeafBit) != 0;
        const char* bytes = is_leaf ? reinterpret_cast<const char*>(&bvh_.leaves[child & ~kLeafBit])
                                    : reinterpret_cast<const char*>(&bvh_.nodes[child]);
        const std::size_t size = is_leaf ? sizeof(Leaf) : sizeof(Node);
        for (std::size_t i = 0; i < size; i += kCacheLine) hwy::Prefetch(bytes + i);
    }

    /// The rectangle that boxes with these bounds of x, y, z are seen in: all of the plane when
    /// they reach to the eye or behind it. Whether it meets the packet, and the box is not behind.
    HWY_INLINE Mask rectangle_of_box(const VF least[3], const VF most[3], Rectangles& r,
                                     std::size_t l) const {
        const Floats f;
        const VF zero = hn::Zero(f);
        const VF all = splat(1e6f);
        const Mask in_front = hn::Gt(least[2], hn::Mul(most[2], splat(0x1p-20f)));
        const VF by_near = hn::Div(splat(1.00001f), hn::Max(least[2], splat(1e-20f)));
        const VF by_far = hn::Div(splat(0.99999f), hn::Max(most[2], splat(1e-20f)));
        const auto low = [&](VF x) {
            return hn::IfThenElse(in_front,
                                  hn::Mul(x, hn::IfThenElse(hn::Lt(x, zero), by_near, by_far)),
                                  hn::Neg(all));
        };
        const auto high = [&](VF x) {
            return hn::IfThenElse(
                in_front, hn::Mul(x, hn::IfThenElse(hn::Gt(x, zero), by_near, by_far)), all);
        };
        const VF lower_x = low(least[0]);
        const VF upper_x = high(most[0]);
        const VF lower_y = low(least[1]);
        const VF upper_y = high(most[1]);
        hn::Store(lower_x, f, r.lower_x + l);
        hn::Store(upper_x, f, r.upper_x + l);
        hn::Store(lower_y, f, r.lower_y + l);
        hn::Store(upper_y, f, r.upper_y + l);
        // A box that reaches behind is held against the packet's four sides: x - side * z over its
        // corners.
        const auto beyond = [&](VF upper, VF lower_z, VF upper_z, float side) {
            return hn::Lt(upper, hn::Mul(splat(side), side > 0 ? lower_z : upper_z));
        };
        const auto before = [&](VF lower, VF lower_z, VF upper_z, float side) {
            return hn::Gt(lower, hn::Mul(splat(side), side > 0 ? upper_z : lower_z));
        };
        const Mask outside = hn::Or(hn::Or(beyond(most[0], least[2], most[2], frame_.lower_x),
                                           before(least[0], least[2], most[2], frame_.upper_x)),
                                    hn::Or(beyond(most[1], least[2], most[2], frame_.lower_y),
                                           before(least[1], least[2], most[2], frame_.upper_y)));
        return hn::AndNot(outside, hn::Gt(most[2], zero));
    }

    void visit_leaf(std::uint32_t leaf_index, std::uint64_t blocks) {
        const Leaf& leaf = bvh_.leaves[leaf_index];
        Setup setup;
        const std::uint32_t alive = TriangleSetup<kOnGrid>(frame_).run(leaf, setup);
        if constexpr (kOnGrid) {
            trace_by_triangle(leaf, setup, alive, blocks);
        } else {
            trace_by_block(leaf, setup, alive, blocks);
        }
    }

    void refresh_block(std::uint32_t block) {
        const Floats f;
        VF least = splat(kDone);
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            least = hn::Min(least, hn::Load(f, packet_.q_lower + block * kBlockRays + l));
        }
        packet_.block_q[block] = hn::GetLane(hn::MinOfLanes(f, least));
    }

    /// What a triangle's set-up is to each of its pairs with a block.
    struct Planes {
        HWY_INLINE Planes(const Setup& setup, std::uint32_t i)
            : a0(splat(setup.a[0][i])),
              a1(splat(setup.a[1][i])),
              a2(splat(setup.a[2][i])),
              b0(splat(setup.b[0][i])),
              b1(splat(setup.b[1][i])),
              b2(splat(setup.b[2][i])),
              c0(splat(setup.c[0][i])),
              c1(splat(setup.c[1][i])),
              c2(splat(setup.c[2][i])),
              depth_a(splat(setup.depth_a[i])),
              depth_b(splat(setup.depth_b[i])),
              depth_c(splat(setup.depth_c[i])),
              bound(splat(setup.bound[i])),
              error0(splat(setup.c0[i])),
              error1(splat(setup.c1[i])),
              error2(splat(setup.c2[i])) {}

        VF a0, a1, a2, b0, b1, b2, c0, c1, c2;
        VF depth_a, depth_b, depth_c;
        VF bound, error0, error1, error2;
    };

    /// What the bounds say of a triangle and as many rays as there are lanes.
    struct Verdict {
        VF q_lower, q_upper;
        Mask inside;  // certainly
        Mask wins;    // certainly: inside, and nearer than the ray's best
        Mask loses;   // certainly; a NaN, from an overflow, does neither
    };

    static HWY_INLINE VF q_error(const Planes& p, VF q) {
        return hn::MulAdd(q, hn::MulAdd(q, p.error2, p.error1), p.error0);
    }

    static HWY_INLINE Verdict judge(const Planes& p, VF x, VF y, VF best_lower, VF best_upper) {
        const VF u = hn::MulAdd(p.a0, x, hn::MulAdd(p.b0, y, p.c0));
        const VF v = hn::MulAdd(p.a1, x, hn::MulAdd(p.b1, y, p.c1));
        const VF w = hn::MulAdd(p.a2, x, hn::MulAdd(p.b2, y, p.c2));
        const VF least = hn::Min(u, hn::Min(v, w));
        const VF q = hn::MulAdd(p.depth_a, x, hn::MulAdd(p.depth_b, y, p.depth_c));
        const VF error = q_error(p, q);
        Verdict verdict;
        verdict.q_lower = hn::Sub(q, error);
        verdict.q_upper = hn::Add(q, error);
        verdict.inside = hn::Gt(least, p.bound);
        verdict.wins = hn::And(verdict.inside, hn::Gt(verdict.q_lower, best_upper));
        verdict.loses =
            hn::Or(hn::Lt(least, hn::Neg(p.bound)), hn::Lt(verdict.q_upper, best_lower));
        return verdict;
    }

    /// One triangle against all rays of one block, closest hits. Whether it wins any.
    HWY_INLINE bool trace_pair(const Planes& planes, const Leaf& leaf, std::uint32_t i,
                               std::uint32_t block, std::uint32_t winner) {
        const Floats f;
        const Words words;
        bool won = false;
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            const std::size_t r = block * kBlockRays + l;
            const VF lower = hn::Load(f, packet_.q_lower + r);
            const VF upper = hn::Load(f, packet_.q_upper + r);
            const Verdict v =
                judge(planes, hn::Load(f, packet_.x + r), hn::Load(f, packet_.y + r), lower, upper);
            hn::Store(hn::IfThenElse(v.wins, v.q_lower, lower), f, packet_.q_lower + r);
            hn::Store(hn::IfThenElse(v.wins, v.q_upper, upper), f, packet_.q_upper + r);
            const VW old = hn::Load(words, packet_.winner + r);
            hn::Store(hn::IfThenElse(hn::RebindMask(words, v.wins), hn::Set(words, winner), old),
                      words, packet_.winner + r);
            won |= !hn::AllFalse(f, v.wins);
            const Mask settled = hn::Or(v.wins, v.loses);
            if (HWY_UNLIKELY(!hn::AllTrue(f, settled)))
                won |= ask_closest(r, leaf, i, mask_bits(hn::Not(settled)), winner);
        }
        return won;
    }

    /// Closest hits: each triangle against its blocks, which are few on a grid and quickly found.
    HWY_INLINE void trace_by_triangle(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                      std::uint64_t blocks) {
        std::uint64_t touched = 0;
        bool won = false;
        const auto first_winner =
            static_cast<std::uint32_t>(packet_.won_leaves.size() * kLeafTriangles);
        for (; alive != 0; alive &= alive - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(alive));
            std::uint64_t own = blocks & blocks_of_grid(setup.ranges, i);
            const Planes planes(setup, i);
            if (hwy::PopCount(own) > kFew) own &= grid_blocks_met(planes);
            touched |= own;
            for (; own != 0; own &= own - 1) {
                const auto block = static_cast<std::uint32_t>(__builtin_ctzll(own));
                if (packet_.block_q[block] > setup.q[i]) continue;
                won |= trace_pair(planes, leaf, i, block, first_winner + i);
            }
        }
        if (won) add_won_leaf(leaf);
        for (; touched != 0; touched &= touched - 1)
            refresh_block(static_cast<std::uint32_t>(__builtin_ctzll(touched)));
    }

    /// The triangles of a leaf whose rectangle meets a block and that are near enough for it.
    HWY_INLINE std::uint32_t triangles_at(const Setup& setup, std::uint32_t block) const {
        const Floats f;
        const Rectangles& rect = setup.rectangles;
        const VF lower_x = splat(packet_.block_lower_x[block]);
        const VF upper_x = splat(packet_.block_upper_x[block]);
        const VF lower_y = splat(packet_.block_lower_y[block]);
        const VF upper_y = splat(packet_.block_upper_y[block]);
        const VF q = splat(packet_.block_q[block]);
        std::uint32_t triangles = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
            const Mask x = hn::And(hn::Le(hn::Load(f, rect.lower_x + l), upper_x),
                                   hn::Ge(hn::Load(f, rect.upper_x + l), lower_x));
            const Mask y = hn::And(hn::Le(hn::Load(f, rect.lower_y + l), upper_y),
                                   hn::Ge(hn::Load(f, rect.upper_y + l), lower_y));
            const Mask near = hn::Ge(hn::Load(f, setup.q + l), q);
            triangles |= mask_bits(hn::And(near, hn::And(x, y))) << l;
        }
        return triangles;
    }

    /// The blocks of a camera's grid of which a ray may win with a triangle: of those that its
    /// rectangle meets many may lie beside it, or have found nearer hits.
    HWY_INLINE std::uint64_t grid_blocks_met(const Planes& p) const {
        const Floats f;
        // From a block's middle to its outermost rays.
        const VF half = splat(0.5f * (kBlockSide - 1) + frame_.grid_margin);
        const auto most = [&](VF a, VF b, VF c) HWY_ATTR {
            return hn::MulAdd(hn::Add(hn::Abs(a), hn::Abs(b)), half, c);
        };
        const VF c0 = most(p.a0, p.b0, p.c0);
        const VF c1 = most(p.a1, p.b1, p.c1);
        const VF c2 = most(p.a2, p.b2, p.c2);
        const VF depth_c = most(p.depth_a, p.depth_b, p.depth_c);
        std::uint64_t blocks = 0;
        for (std::size_t l = 0; l < kPacketBlocks; l += hn::Lanes(f)) {
            const VF x = hn::Load(f, kGridMiddles.x + l);
            const VF y = hn::Load(f, kGridMiddles.y + l);
            const VF u = hn::MulAdd(p.a0, x, hn::MulAdd(p.b0, y, c0));
            const VF v = hn::MulAdd(p.a1, x, hn::MulAdd(p.b1, y, c1));
            const VF w = hn::MulAdd(p.a2, x, hn::MulAdd(p.b2, y, c2));
            const VF q = hn::MulAdd(p.depth_a, x, hn::MulAdd(p.depth_b, y, depth_c));
            const VF q_upper = hn::Add(q, q_error(p, q));
            const Mask out = hn::Or(hn::Lt(hn::Min(u, hn::Min(v, w)), hn::Neg(p.bound)),
                                    hn::Lt(q_upper, hn::Load(f, packet_.block_q + l)));
            blocks |= std::uint64_t{mask_bits(hn::Not(out))} << l;
        }
        return blocks;
    }

    /// Of some triangles of a leaf those that a ray of a block may hit.
    HWY_INLINE std::uint32_t triangles_met(const Setup& setup, std::uint32_t block) const {
        const Floats f;
        const auto middle = [](float lower, float upper) { return 0.5f * (lower + upper); };
        const VF x = splat(middle(packet_.block_lower_x[block], packet_.block_upper_x[block]));
        const VF y = splat(middle(packet_.block_lower_y[block], packet_.block_upper_y[block]));
        // Rounding of the middles, up to 17, included.
        const VF half_x = hn::Sub(splat(packet_.block_upper_x[block] + 0x1p-19f), x);
        const VF half_y = hn::Sub(splat(packet_.block_upper_y[block] + 0x1p-19f), y);
        std::uint32_t triangles = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
            const auto most = [&](const float* a_of, const float* b_of,
                                  const float* c_of) HWY_ATTR {
                const VF a = hn::Load(f, a_of + l);
                const VF b = hn::Load(f, b_of + l);
                const VF in_middle = hn::MulAdd(a, x, hn::MulAdd(b, y, hn::Load(f, c_of + l)));
                return hn::MulAdd(hn::Abs(a), half_x, hn::MulAdd(hn::Abs(b), half_y, in_middle));
            };
            const VF u = most(setup.a[0], setup.b[0], setup.c[0]);
            const VF v = most(setup.a[1], setup.b[1], setup.c[1]);
            const VF w = most(setup.a[2], setup.b[2], setup.c[2]);
            const VF q = most(setup.depth_a, setup.depth_b, setup.depth_c);
            const VF q_error =
                hn::MulAdd(q, hn::MulAdd(q, hn::Load(f, setup.c2 + l), hn::Load(f, setup.c1 + l)),
                           hn::Load(f, setup.c0 + l));
            const Mask out =
                hn::Or(hn::Lt(hn::Min(u, hn::Min(v, w)), hn::Neg(hn::Load(f, setup.bound + l))),
                       hn::Lt(hn::Add(q, q_error), splat(packet_.block_q[block])));
            triangles |= mask_bits(hn::Not(out)) << l;
        }
        return triangles;
    }

    /// Any hits: each block against the triangles that it meets; blocks lie anywhere, and some end
    /// early. What is known of their rays stays in registers meanwhile.
    HWY_INLINE void trace_by_block(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                   std::uint64_t blocks) {
        const Floats f;
        for (; blocks != 0; blocks &= blocks - 1) {
            const auto block = static_cast<std::uint32_t>(__builtin_ctzll(blocks));
            std::uint32_t triangles = alive & triangles_at(setup, block);
            if (hwy::PopCount(triangles) > kFew) triangles &= triangles_met(setup, block);
            if (triangles == 0) continue;
            bool any = false;
            for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f))
                any |= occlude(leaf, setup, triangles, block * kBlockRays + l);
            if (any) refresh_block(block);
        }
    }

    /// Some triangles of a leaf against the rays from r on, any hits. Whether there is one.
    HWY_INLINE bool occlude(const Leaf& leaf, const Setup& setup, std::uint32_t triangles,
                            std::size_t r) {
        const Floats f;
        const VF x = hn::Load(f, packet_.x + r);
        const VF y = hn::Load(f, packet_.y + r);
        const VF lower = hn::Load(f, packet_.q_lower + r);
        const VF upper = hn::Load(f, packet_.q_upper + r);
        const Mask done_before = hn::Eq(upper, splat(kDone));
        Mask done = done_before;
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(triangles));
            const Verdict v = judge(Planes(setup, i), x, y, lower, upper);
            done = hn::Or(done, v.wins);
            const Mask open = hn::Not(hn::Or(done, v.loses));
            if (HWY_UNLIKELY(!hn::AllFalse(f, open))) {
                done = hn::Or(done, mask_of(ask_any(r, leaf, i, mask_bits(open))));
            }
            if (hn::AllTrue(f, done)) break;
        }
        if (hn::AllFalse(f, hn::AndNot(done_before, done))) return false;
        hn::Store(hn::IfThenElse(done, splat(kDone), lower), f, packet_.q_lower + r);
        hn::Store(hn::IfThenElse(done, splat(kDone), upper), f, packet_.q_upper + r);
        return true;
    }

    HWY_INLINE void add_won_leaf(const Leaf& leaf) {
        const Floats f;
        packet_.won_leaves.emplace_back();
        WonLeaf& won = packet_.won_leaves.back();
        won.leaf = &leaf;
        alignas(64) float values[3][kLeafVertices];
        alignas(64) std::uint32_t corners[kLeafTriangles];
        for (std::size_t l = 0; l < kLeafVertices; l += hn::Lanes(f)) {
            VF v[3], w;
            hn::LoadInterleaved4(f, &leaf.vertex[l].x, v[0], v[1], v[2], w);
            for (int axis = 0; axis < 3; ++axis)
                hn::Store(hn::Sub(v[axis], splat(frame_.org[axis])), f, values[axis] + l);
            hn::Store(hn::BitCast(Words(), w), Words(), corners + l);
        }
        const std::uint32_t z = frame_.axis;
        for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
            const VW packed = hn::Load(Words(), corners + l);
            for (std::uint32_t axis = 0; axis < 3; ++axis) {
                VF at_corners[3];
                gather_corners(values[(z + 1 + axis) % 3], packed, at_corners);
                for (int k = 0; k < 3; ++k) hn::Store(at_corners[k], f, won.corner[k][axis] + l);
            }
        }
    }

    /// Of some rays from r on, in doubt about a triangle: those that it occludes.
    HWY_NOINLINE std::uint32_t ask_any(std::size_t r, const Leaf& leaf, std::uint32_t i,
                                       std::uint32_t lanes) const {
        const VF tfar = hn::Load(Floats(), packet_.tfar + r);
        RuleHits hits;
        return mask_bits(
            PacketRule(packet_, r).intersect(same_triangle(leaf, i), tfar, lanes, hits));
    }

    /// Likewise closest hits. Whether the triangle wins any of them.
    HWY_NOINLINE bool ask_closest(std::size_t r, const Leaf& leaf, std::uint32_t i,
                                  std::uint32_t lanes, std::uint32_t winner) {
        const Floats f;
        const Words words;
        const PacketRule rule(packet_, r);
        const VF no_end = splat(kInfiniteT);
        const TriangleLanes triangle = same_triangle(leaf, i);
        RuleHits hit;
        Mask wins = rule.intersect(triangle, no_end, lanes, hit);
        const VW old = hn::Load(words, packet_.winner + r);
        const Mask has_old = hn::RebindMask(f, hn::Ne(old, hn::Set(words, kNoWinner)));
        const std::uint32_t rivals = mask_bits(hn::And(wins, has_old));
        if (rivals != 0) {
            const TriangleLanes best = winning_triangles(packet_, r, rivals, &leaf);
            RuleHits best_hit;
            rule.intersect(best, no_end, rivals, best_hit);
            const Mask smaller_id = hn::RebindMask(f, hn::Lt(triangle.prim_ids, best.prim_ids));
            const Mask nearer =
                hn::Or(hn::Lt(hit.t, best_hit.t), hn::And(hn::Eq(hit.t, best_hit.t), smaller_id));
            wins = hn::And(wins, hn::Or(nearer, hn::Not(has_old)));
        }
        if (hn::AllFalse(f, wins)) return false;
        VF z = hn::Zero(f);  // of the directions
        for (int axis = 0; axis < 3; ++axis) {
            z = hn::MulAdd(splat(frame_.rows_f[2][axis]), hn::Load(f, packet_.dir[axis] + r), z);
        }
        const VF q = hn::Div(splat(1.0f), hn::Mul(hit.t, z));
        const auto store = [&](VF value, float* out) HWY_ATTR {
            hn::Store(hn::IfThenElse(wins, value, hn::Load(f, out)), f, out);
        };
        store(hn::Mul(q, splat(1 - 0x1p-16f)), packet_.q_lower + r);
        store(hn::Mul(q, splat(1 + 0x1p-16f)), packet_.q_upper + r);
        hn::Store(hn::IfThenElse(hn::RebindMask(words, wins), hn::Set(words, winner), old), words,
                  packet_.winner + r);
        return true;
    }

    const Bvh& bvh_;
    Packet& packet_;
    const PacketFrame& frame_;
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
