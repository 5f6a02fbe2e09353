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

#include "common/bvh.h"
#include "common/interop/triangle.h"
#include "cpu/packet.h"
#include "cpu/packet_blocks-inl.h"
#include "cpu/packet_doubts-inl.h"
#include "cpu/packet_node-inl.h"
#include "cpu/packet_pairs-inl.h"
#include "cpu/packet_rule-inl.h"
#include "cpu/packet_setup-inl.h"
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

enum class Query { kClosest, kAny };

/// Closest hits are wanted of cameras, whose blocks lie on a grid; any hits of rays from a light,
/// which lie anywhere.
template <Query kQuery>
class PacketTraversal {
public:
    PacketTraversal(const Bvh& bvh, Packet& packet)
        : bvh_(bvh), packet_(packet), frame_(packet.frame), doubts_(packet) {}

    /// Visits the root, which needs the packet's bounds alone. Whether there is anything to go on
    /// with.
    bool start() {
        Entry root = {kAnyDepth, 0, {}};
        for (std::uint64_t& word : root.blocks.words) word = kAllBlocks;
        visit_node(root, stack_, size_);
        return size_ > 0;
    }

    void run() {
        Entry* stack = stack_;
        std::uint32_t& size = size_;
        while (size > 0) {
            Entry entry = stack[--size];
            if (!still_matters(entry)) continue;
            if ((entry.child & kLeafBit) == 0) {
                visit_node(entry, stack, size);
            } else {
                visit_leaf(entry.child & ~kLeafBit, entry.blocks);
            }
        }
        if constexpr (kOnGrid) doubts_.settle();
    }

private:
    static constexpr std::size_t kCacheLine = 64;
    /// A triangle's pairs with blocks that are traced rather than first looked at together.
    static constexpr int kFew = 4;
    static constexpr bool kOnGrid = kQuery == Query::kClosest;
    static constexpr std::size_t kWords = (kOnGrid ? kGridBlocks : kPointBlocks) / 64;

    /// What a traversal has still to visit.
    struct Entry {
        float q;  // nearest_q of the box
        std::uint32_t child;
        BlockSet<kWords> blocks;
    };

    /// Some blocks of a camera's packet: bit b is block first + b.
    struct Window {
        std::uint32_t first;
        std::uint64_t blocks;
    };

    /// Leaves those blocks of an entry that it is near enough for. Whether there are any.
    HWY_INLINE bool still_matters(Entry& entry) {
        std::uint64_t any = leave_near(entry);
        if constexpr (kOnGrid) {
            std::uint64_t certain = 0;
            for (std::size_t w = 0; w < kWords; ++w)
                certain |= entry.blocks.words[w] & ~doubtful_blocks_.words[w];
            if (HWY_UNLIKELY(certain == 0 && any != 0)) {
                settle();
                any = leave_near(entry);
            }
        }
        return any != 0;
    }

    HWY_INLINE std::uint64_t leave_near(Entry& entry) const {
        std::uint64_t any = 0;
        for (std::size_t w = 0; w < kWords; ++w) {
            entry.blocks.words[w] &= blocks_beyond(packet_, entry.q, w);
            any |= entry.blocks.words[w];
        }
        return any;
    }

    HWY_INLINE std::uint64_t blocks_of(const Rectangles& rectangles, const GridRanges& ranges,
                                       std::uint32_t i, std::size_t word) const {
        return kOnGrid ? blocks_of_grid(ranges, i, word) : blocks_in(packet_, rectangles, i);
    }

    void visit_node(const Entry& entry, Entry* stack, std::uint32_t& size) const {
        const Node& node = bvh_.nodes[entry.child];
        NodeChildren children;
        std::uint32_t hits = project_node(frame_, node, children);
        const Rectangles& rectangles = children.rectangles;
        const float* q = children.q;
        GridRanges ranges;
        if constexpr (kOnGrid) to_grid(frame_, rectangles, ranges);
        const std::uint32_t base = size;
        for (; hits != 0; hits &= hits - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(hits));
            if (node.child[slot] == kEmptyChild) break;
            BlockSet<kWords> blocks;
            std::uint64_t any = 0;
            for (std::size_t w = 0; w < kWords; ++w) {
                std::uint64_t own = entry.blocks.words[w] & blocks_of(rectangles, ranges, slot, w);
                if constexpr (!kOnGrid) own &= blocks_beyond(packet_, q[slot], w);
                blocks.words[w] = own;
                any |= own;
            }
            if (any == 0) continue;
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

    void visit_leaf(std::uint32_t leaf_index, const BlockSet<kWords>& blocks) {
        const Leaf& leaf = bvh_.leaves[leaf_index];
        Setup setup;
        const std::uint32_t alive = TriangleSetup<kOnGrid>(frame_).run(leaf, setup);
        if constexpr (kOnGrid) {
            trace_by_triangle(leaf, setup, alive, blocks);
        } else {
            trace_by_block(leaf, setup, alive, blocks.words[0]);
        }
    }

    /// One triangle against all rays of one block, closest hits. Whether it wins any for sure.
    HWY_INLINE bool trace_pair(const Planes& planes, const Leaf& leaf, std::uint32_t block,
                               std::uint32_t winner) {
        const Floats f;
        const Words words;
        bool won = false;
        VF least = splat(kDone);
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            const std::size_t r = block * kBlockRays + l;
            const VF x = hn::Load(f, kGridRays.x[block % kGridSide] + l);
            const VF y = hn::Load(f, kGridRays.y[block / kGridSide] + l);
            const VF lower = hn::Load(f, packet_.q_lower + r);
            const VF upper = hn::Load(f, packet_.q_upper + r);
            const Position at(planes, x, y);
            const Mask wins = at.wins(planes, upper);
            const VF new_lower = hn::IfThenElse(wins, at.q_lower, lower);
            least = hn::Min(least, new_lower);
            hn::Store(new_lower, f, packet_.q_lower + r);
            hn::Store(hn::IfThenElse(wins, at.q_upper, upper), f, packet_.q_upper + r);
            const VW old = hn::Load(words, packet_.winner + r);
            hn::Store(hn::IfThenElse(hn::RebindMask(words, wins), hn::Set(words, winner), old),
                      words, packet_.winner + r);
            won |= !hn::AllFalse(f, wins);
            const Mask settled = hn::Or(wins, at.loses(planes, lower));
            if (HWY_UNLIKELY(!hn::AllTrue(f, settled)))
                doubt(r, mask_bits(hn::Not(settled)), leaf, winner);
        }
        packet_.block_q[block] = hn::GetLane(hn::MinOfLanes(f, least));
        return won;
    }

    /// Some rays from r on that a triangle of a leaf may win.
    HWY_NOINLINE void doubt(std::size_t r, std::uint32_t lanes, const Leaf& leaf,
                            std::uint32_t winner) {
        if (winner / kLeafTriangles == packet_.won_leaves.size()) add_won_leaf(leaf);
        doubts_.add(r, lanes, winner);
        const std::size_t block = r / kBlockRays;
        doubtful_blocks_.words[block / 64] |= std::uint64_t{1} << block % 64;
        if (doubts_.many()) settle();
    }

    /// Lets the rule decide what is in doubt.
    HWY_NOINLINE void settle() {
        doubts_.settle();
        doubtful_blocks_ = {};
    }

    /// The blocks that a triangle's rectangle meets, if they fit into a window.
    HWY_INLINE Window window_of(const Setup& setup, std::uint32_t i) const {
        const std::uint32_t first = setup.windows.first[i];
        std::uint64_t blocks = kWindows.of[setup.windows.shape[i]];
        if (hwy::PopCount(blocks) > kFew && blocks != kAllBlocks)
            blocks &= window_blocks_met(BlockTest(frame_, Planes(setup, i)), first);
        return {first, blocks};
    }

    /// A triangle against some blocks. Whether it wins a ray.
    HWY_INLINE bool trace_window(const Planes& planes, const Leaf& leaf, std::uint32_t winner,
                                 const Window& window) {
        bool won = false;
        for (std::uint64_t blocks = window.blocks; blocks != 0; blocks &= blocks - 1) {
            const auto bit = static_cast<std::uint32_t>(__builtin_ctzll(blocks));
            won |= trace_pair(planes, leaf, window.first + bit, winner);
        }
        return won;
    }

    /// Closest hits: each triangle against its blocks, which are few on a grid and quickly found.
    HWY_INLINE void trace_by_triangle(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                      const BlockSet<kWords>& blocks) {
        const auto first_winner =
            static_cast<std::uint32_t>(packet_.won_leaves.size() * kLeafTriangles);
        if (alive == 0) return;
        bool won = false;
        auto i = static_cast<std::uint32_t>(__builtin_ctz(alive));
        Window window = window_of(setup, i);
        while (alive != 0) {
            alive &= alive - 1;
            const std::uint32_t next =
                alive != 0 ? static_cast<std::uint32_t>(__builtin_ctz(alive)) : i;
            const Window next_window = window_of(setup, next);
            const Planes planes(setup, i);
            if (HWY_LIKELY(window.blocks != kAllBlocks)) {
                won |= trace_window(planes, leaf, first_winner + i, window);
            } else {
                const BlockTest test(frame_, planes);
                for (std::uint32_t w = 0; w < kWords; ++w) {
                    std::uint64_t own =
                        blocks.words[w] & blocks_of_grid(setup.windows.ranges, i, w);
                    if (own == 0) continue;
                    own &= grid_blocks_met(packet_, test, w);
                    won |= trace_window(planes, leaf, first_winner + i, {64 * w, own});
                }
            }
            i = next;
            window = next_window;
        }
        if (won && first_winner == packet_.won_leaves.size() * kLeafTriangles) add_won_leaf(leaf);
    }

    /// Any hits: each block against the triangles that it meets; blocks lie anywhere, and some end
    /// early. What is known of their rays stays in registers meanwhile.
    HWY_INLINE void trace_by_block(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                   std::uint64_t blocks) {
        const Floats f;
        if (alive == 0) return;
        auto block = static_cast<std::uint32_t>(__builtin_ctzll(blocks));
        std::uint32_t triangles = alive & triangles_at(packet_, setup, block);
        while (blocks != 0) {
            blocks &= blocks - 1;
            const std::uint32_t next =
                blocks != 0 ? static_cast<std::uint32_t>(__builtin_ctzll(blocks)) : block;
            const std::uint32_t next_triangles = alive & triangles_at(packet_, setup, next);
            if (triangles != 0) {
                bool any = false;
                for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f))
                    any |= occlude(leaf, setup, triangles, block * kBlockRays + l);
                if (any) find_depth(packet_, block);
            }
            block = next;
            triangles = next_triangles;
        }
    }

    /// Some triangles of a leaf against the rays from r on, any hits. Whether there is one.
    HWY_INLINE bool occlude(const Leaf& leaf, const Setup& setup, std::uint32_t triangles,
                            std::size_t r) {
        const Floats f;
        const VF x = hn::Load(f, packet_.x + r);
        const VF y = hn::Load(f, packet_.y + r);
        VF lower = hn::Load(f, packet_.q_lower + r);
        VF upper = hn::Load(f, packet_.q_upper + r);
        bool any = false;
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(triangles));
            const Planes planes(setup, i);
            const Position at(planes, x, y);
            const Mask loses = at.loses(planes, lower);
            // Most triangles are those of the surface that the rays end at.
            if (HWY_LIKELY(hn::AllTrue(f, loses))) continue;
            Mask wins = at.wins(planes, upper);
            const Mask open = hn::Not(hn::Or(wins, loses));
            if (HWY_UNLIKELY(!hn::AllFalse(f, open)))
                wins = hn::Or(wins, mask_of(ask_any(r, leaf, i, mask_bits(open))));
            if (hn::AllFalse(f, wins)) continue;
            any = true;
            lower = hn::IfThenElse(wins, splat(kDone), lower);
            upper = hn::IfThenElse(wins, splat(kDone), upper);
            if (hn::AllTrue(f, hn::Eq(upper, splat(kDone)))) break;
        }
        if (!any) return false;
        hn::Store(lower, f, packet_.q_lower + r);
        hn::Store(upper, f, packet_.q_upper + r);
        return true;
    }

    HWY_INLINE void add_won_leaf(const Leaf& leaf) {
        const Floats f;
        packet_.won_leaves.emplace_back();
        WonLeaf& won = packet_.won_leaves.back();
        won.leaf = &leaf;
        std::memcpy(won.prim_id, leaf.prim_id, sizeof won.prim_id);
        const VF away = frame_.axis == kMixedAxes
                            ? hn::Zero(f)
                            : hn::And(splat(frame_.depth_rows[0][2]), splat(-0.0f));
        alignas(64) float values[3][kLeafVertices];
        alignas(64) std::uint32_t corners[kLeafTriangles];
        for (std::size_t l = 0; l < kLeafVertices; l += hn::Lanes(f)) {
            VF v[3], w;
            hn::LoadInterleaved4(f, &leaf.vertex[l].x, v[0], v[1], v[2], w);
            for (int axis = 0; axis < 3; ++axis)
                hn::Store(hn::Xor(hn::Sub(v[axis], splat(frame_.org[axis])), away), f,
                          values[axis] + l);
            hn::Store(hn::BitCast(Words(), w), Words(), corners + l);
        }
        const std::uint32_t z = frame_.axis % kMixedAxes;
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
        const VF dir[3] = {hn::Load(Floats(), packet_.dir[0] + r),
                           hn::Load(Floats(), packet_.dir[1] + r),
                           hn::Load(Floats(), packet_.dir[2] + r)};
        RuleHits hits;
        return mask_bits(PacketRule(packet_.frame.org, dir)
                             .intersect(same_triangle(leaf, i), tfar, lanes, hits));
    }

    const Bvh& bvh_;
    Packet& packet_;
    const PacketFrame& frame_;
    PacketDoubts doubts_;
    /// The blocks of rays that are in doubt: what can be hit there matters to them for longer.
    BlockSet<kWords> doubtful_blocks_ = {};
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
