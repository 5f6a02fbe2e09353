// Packets of a camera's rays against the shared layout, written once for every width of vector; for
// those of a point see packet_any-inl.h.
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

#include <hwy/highway.h>

#include <algorithm>

#include "common/bvh.h"
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

/// Closest hits of cameras, whose blocks lie on a grid.
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
            const bool is_node = (entry.child & kLeafBit) == 0;
            if (is_node) find_depths();
            if (!still_matters(entry)) continue;
            if (is_node) {
                visit_node(entry, stack, size);
            } else {
                visit_leaf(entry.child & ~kLeafBit, entry.blocks);
            }
        }
        doubts_.settle();
    }

private:
    /// A triangle's pairs with blocks that are traced rather than first looked at together.
    static constexpr int kFew = 4;
    static constexpr std::size_t kWords = kGridBlocks / 64;

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
        std::uint64_t certain = 0;
        for (std::size_t w = 0; w < kWords; ++w)
            certain |= entry.blocks.words[w] & ~doubtful_blocks_.words[w];
        if (HWY_UNLIKELY(certain == 0 && any != 0)) {
            settle();
            any = leave_near(entry);
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

    void visit_node(const Entry& entry, Entry* stack, std::uint32_t& size) const {
        const Node& node = bvh_.nodes[entry.child];
        NodeChildren children;
        std::uint32_t hits = project_node(frame_, node, children);
        const float* q = children.q;
        GridRanges ranges;
        to_grid(frame_, children.rectangles, ranges);
        const std::uint32_t base = size;
        for (; hits != 0; hits &= hits - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(hits));
            if (node.child[slot] == kEmptyChild) break;
            BlockSet<kWords> blocks;
            std::uint64_t any = 0;
            for (std::size_t w = 0; w < kWords; ++w) {
                blocks.words[w] = entry.blocks.words[w] & blocks_of_grid(ranges, slot, w);
                any |= blocks.words[w];
            }
            if (any == 0) continue;
            std::uint32_t place = size++;
            for (; place > base && stack[place - 1].q > q[slot]; --place)
                stack[place] = stack[place - 1];
            stack[place] = {q[slot], node.child[slot], blocks};
            prefetch_child(bvh_, node.child[slot]);
        }
    }

    void visit_leaf(std::uint32_t leaf_index, const BlockSet<kWords>& blocks) {
        const Leaf& leaf = bvh_.leaves[leaf_index];
        Setup setup;
        const std::uint32_t alive = TriangleSetup<true>(frame_).run(leaf, setup);
        trace_by_triangle(leaf, setup, alive, blocks);
    }

    /// One triangle against all rays of one block, closest hits. Whether it wins any for sure. A
    /// triangle that is hit for sure bounds what matters from now on, though it may be in doubt
    /// whether it is the nearest.
    HWY_INLINE bool trace_pair(const GridPlanes& p, std::uint32_t block, std::uint32_t winner) {
        const Floats f;
        Packet& packet = packet_;
        bool won = false;
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            const std::size_t r = block * kBlockRays + l;
            const VF x = hn::Load(f, kGridRays.x[block % kGridSide] + l);
            const VF y = hn::Load(f, kGridRays.y[block / kGridSide] + l);
            const VF lower = hn::Load(f, packet.q_lower + r);
            const VF upper = hn::Load(f, packet.q_upper + r);
            const VF least = p.least_edge(x, y);
            const VF q = p.depth(x, y);
            const Mask inside = hn::Gt(least, p.bound);
            const VF own_lower = hn::IfThenElseZero(inside, hn::Sub(q, p.error));
            const VF own_upper = hn::Add(q, p.error);
            const Mask wins = hn::Gt(own_lower, upper);
            const Mask loses = hn::Or(hn::Lt(least, hn::Neg(p.bound)), hn::Lt(own_upper, lower));
            hn::Store(hn::Max(own_lower, lower), f, packet.q_lower + r);
            hn::Store(hn::IfThenElse(wins, own_upper, upper), f, packet.q_upper + r);
            store_where(wins, winner, packet.winner + r);
            won |= !hn::AllFalse(f, wins);
            const Mask settled = hn::Or(wins, loses);
            if (HWY_UNLIKELY(!hn::AllTrue(f, settled)))
                open_[open_count_++] = {static_cast<std::uint32_t>(r), mask_bits(hn::Not(settled)),
                                        winner};
        }
        return won;
    }

    /// Has the rule asked later about what a leaf has left open.
    HWY_NOINLINE void put_off(const Leaf& leaf, std::uint32_t first_winner) {
        if (first_winner == packet_.won_leaves.size() * kLeafTriangles) add_won_leaf(packet_, leaf);
        for (std::uint32_t i = 0; i < open_count_; ++i) {
            const Open& open = open_[i];
            doubts_.add(open.ray, open.lanes, open.winner);
            const std::size_t block = open.ray / kBlockRays;
            doubtful_blocks_.words[block / 64] |= std::uint64_t{1} << block % 64;
            if (doubts_.many()) settle();
        }
        open_count_ = 0;
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
            blocks &= window_blocks_met(frame_, GridPlanes(setup, i), first);
        return {first, blocks};
    }

    /// A triangle against some blocks. Whether it wins a ray.
    HWY_INLINE bool trace_window(const GridPlanes& planes, std::uint32_t winner,
                                 const Window& window) {
        bool won = false;
        for (std::uint64_t blocks = window.blocks; blocks != 0; blocks &= blocks - 1) {
            const auto bit = static_cast<std::uint32_t>(__builtin_ctzll(blocks));
            won |= trace_pair(planes, window.first + bit, winner);
        }
        return won;
    }

    /// A triangle against its blocks. Whether it wins a ray.
    HWY_INLINE bool trace_triangle(const Setup& setup, std::uint32_t i, const Window& window,
                                   const BlockSet<kWords>& blocks, std::uint32_t winner) {
        const GridPlanes planes(setup, i);
        if (HWY_LIKELY(window.blocks != kAllBlocks)) {
            const std::uint32_t word = window.first / 64;
            const std::uint32_t shift = window.first % 64;
            traced_.words[word] |= window.blocks << shift;
            traced_.words[word + 1] |= window.blocks >> 1 >> (63 - shift);
            return trace_window(planes, winner, window);
        }
        const BlockSet<kWords> met = grid_blocks_met(packet_, planes, setup.windows.ranges.rows[i]);
        const std::uint64_t columns = setup.windows.ranges.columns[i] * kEachRow;
        bool won = false;
        for (std::uint32_t w = 0; w < kWords; ++w) {
            const std::uint64_t own = blocks.words[w] & met.words[w] & columns;
            traced_.words[w] |= own;
            won |= trace_window(planes, winner, {64 * w, own});
        }
        return won;
    }

    /// Closest hits: each triangle against its blocks, which are few on a grid and quickly found;
    /// those of the next one before this one is traced.
    HWY_INLINE void trace_by_triangle(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                      const BlockSet<kWords>& blocks) {
        if (alive == 0) return;
        const auto first_winner =
            static_cast<std::uint32_t>(packet_.won_leaves.size() * kLeafTriangles);
        bool won = false;
        auto i = static_cast<std::uint32_t>(__builtin_ctz(alive));
        Window window = window_of(setup, i);
        while (alive != 0) {
            alive &= alive - 1;
            const std::uint32_t next =
                alive != 0 ? static_cast<std::uint32_t>(__builtin_ctz(alive)) : i;
            const Window next_window = window_of(setup, next);
            won |= trace_triangle(setup, i, window, blocks, first_winner + i);
            if (HWY_UNLIKELY(open_count_ >= kManyOpen)) put_off(leaf, first_winner);
            i = next;
            window = next_window;
        }
        if (HWY_UNLIKELY(open_count_ != 0)) put_off(leaf, first_winner);
        if (won && first_winner == packet_.won_leaves.size() * kLeafTriangles)
            add_won_leaf(packet_, leaf);
    }

    /// Finds the depth of blocks that triangles were held against.
    void find_depths() {
        for (std::uint32_t w = 0; w < kWords; ++w) {
            std::uint64_t left = traced_.words[w];
            for (auto count = static_cast<int>(hwy::PopCount(left)); count > 0; count -= 4) {
                std::uint32_t four[4];
                for (std::uint32_t& block : four) {
                    block = 64 * w + static_cast<std::uint32_t>(__builtin_ctzll(left));
                    const std::uint64_t rest = left & (left - 1);
                    left = rest != 0 ? rest : left;
                }
                find_four_depths(packet_, four);
            }
        }
        traced_ = {};
    }

    const Bvh& bvh_;
    Packet& packet_;
    const PacketFrame& frame_;
    PacketDoubts doubts_;
    /// Pairs that a leaf has left open: of some rays from `ray` on and a triangle.
    struct Open {
        std::uint32_t ray, lanes, winner;
    };
    static constexpr std::uint32_t kManyOpen = 64;
    Open open_[kManyOpen + kCameraRays / hn::MaxLanes(Floats())];
    std::uint32_t open_count_ = 0;
    /// The blocks that triangles were held against since depths were found. An empty window may
    /// begin after the last.
    BlockSet<kWords + 2> traced_ = {};
    /// The blocks of rays that are in doubt: what can be hit there matters to them for longer.
    BlockSet<kWords> doubtful_blocks_ = {};
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
