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
// the hit rule (common/interop/hit_rule.h) computes; where the bound leaves no doubt they stand for
// the rule, and where it leaves one, the rule itself is asked. So any arithmetic may be used, fused
// or not.

#if defined(MORPHRAY_CPU_PACKET_PACKET_TRACER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_PACKET_TRACER_INL_H
#undef MORPHRAY_CPU_PACKET_PACKET_TRACER_INL_H
#else
#define MORPHRAY_CPU_PACKET_PACKET_TRACER_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "common/bvh/bvh.h"
#include "cpu/packet/camera_packet_grid-inl.h"
#include "cpu/packet/deferred_rays-inl.h"
#include "cpu/packet/packet.h"
#include "cpu/packet/packet_blocks-inl.h"
#include "cpu/packet/packet_hit_rule-inl.h"
#include "cpu/packet/packet_node-inl.h"
#include "cpu/packet/triangle_setup-inl.h"
#include "cpu/simd/fast_hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Closest hits of cameras, whose blocks lie on a grid.
class PacketTraversal {
public:
    PacketTraversal(const Bvh& bvh, Packet& packet)
        : bvh_(bvh), packet_(packet), frame_(packet.frame), deferred_(packet) {}

    /// Visits the root, which needs the packet's bounds alone. Whether there is anything to go on
    /// with.
    bool start() {
        Entry root = {{}, kAnyDepth, 0};
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
        settle();
    }

private:
    static constexpr std::size_t kWords = kGridBlocks / 64;

    /// What a traversal has still to visit.
    struct alignas(64) Entry {
        BlockSet<kWords> blocks;
        float q;  // nearest_q of the box
        std::uint32_t child;
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
            certain |= entry.blocks.words[w] & ~uncertain_blocks_.words[w];
        if (HWY_UNLIKELY(certain == 0 && any != 0)) {
            settle();
            find_depths();
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
            if (!blocks_of_grid(ranges.columns[slot], ranges.rows[slot], entry.blocks, blocks))
                continue;
            std::uint32_t place = size++;
            for (; place > base && stack[place - 1].q > q[slot]; --place)
                stack[place] = stack[place - 1];
            stack[place] = {blocks, q[slot], node.child[slot]};
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
    /// triangle that is hit for sure bounds what matters from now on, though it may be uncertain
    /// whether it is the nearest.
    template <class Values>
    HWY_INLINE bool trace_pair(const GridPlanes& p, const Values& values, std::uint32_t block,
                               std::uint32_t candidate) {
        Packet& packet = packet_;
        bool won = false;
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec lower = load(packet.q_lower + r);
            const FloatVec upper = load(packet.q_upper + r);
            const FloatVec least = values.least_edge(l);
            const FloatVec q = values.depth(l);
            const Mask inside = least > p.bound;
            const FloatVec own_lower = zero_unless(inside, q - p.error);
            const FloatVec own_upper = q + p.error;
            const Mask wins = own_lower > upper;
            const Mask loses = (least < -p.bound) | (own_upper < lower);
            store(max(own_lower, lower), packet.q_lower + r);
            store(select(wins, own_upper, upper), packet.q_upper + r);
            store_where(wins, candidate, packet.candidate + r);
            won |= !none(wins);
            const Mask settled = wins | loses;
            if (HWY_UNLIKELY(!all(settled)))
                open_[open_count_++] = {static_cast<std::uint32_t>(r), bits_of(!settled),
                                        candidate};
        }
        return won;
    }

    /// Has the rule asked later about what a leaf has left open.
    HWY_NOINLINE void put_off(const Leaf& leaf, std::uint32_t first_candidate) {
        if (first_candidate == packet_.hit_leaves.size() * kLeafTriangles)
            add_hit_leaf(packet_, leaf);
        for (std::uint32_t i = 0; i < open_count_; ++i) {
            const Open& open = open_[i];
            deferred_.add(open.ray, open.lanes, open.candidate);
            const std::size_t block = open.ray / kBlockRays;
            uncertain_blocks_.words[block / 64] |= std::uint64_t{1} << block % 64;
            if (deferred_.many()) settle();
        }
        open_count_ = 0;
    }

    /// Lets the rule decide what is uncertain.
    HWY_NOINLINE void settle() {
        deferred_.settle(traced_);
        uncertain_blocks_ = {};
    }

    /// The blocks that a triangle's rectangle meets, which fit into a window.
    static HWY_INLINE Window window_of(const Setup& setup, std::uint32_t i) {
        const GridWindows& windows = setup.windows;
        return {windows.first[i], kWindows.of[windows.columns[i]][windows.rows[i]]};
    }

    /// Triangles that meet few blocks, against each of these. Whether they win a ray. The next
    /// one's blocks are looked for before this one is traced.
    HWY_INLINE bool trace_few(const Leaf& leaf, const Setup& setup, std::uint32_t triangles,
                              std::uint32_t first_candidate) {
        if (triangles == 0) return false;
        bool won = false;
        auto i = static_cast<std::uint32_t>(__builtin_ctz(triangles));
        Window window = window_of(setup, i);
        while (triangles != 0) {
            triangles &= triangles - 1;
            const std::uint32_t next =
                triangles != 0 ? static_cast<std::uint32_t>(__builtin_ctz(triangles)) : i;
            const Window next_window = window_of(setup, next);
            const GridPlanes planes(setup, i);
            for (std::uint64_t blocks = window.blocks; blocks != 0; blocks &= blocks - 1) {
                const std::uint32_t block =
                    window.first + static_cast<std::uint32_t>(__builtin_ctzll(blocks));
                won |= trace_pair(planes, GridValues{planes, block}, block, first_candidate + i);
            }
            put_off_many(leaf, first_candidate);
            i = next;
            window = next_window;
        }
        return won;
    }

    /// Triangles that meet more blocks of a window.
    HWY_INLINE bool trace_many(const Leaf& leaf, const Setup& setup, std::uint32_t triangles,
                               std::uint32_t first_candidate) {
        bool won = false;
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(triangles));
            const GridPlanes planes(setup, i);
            const GridWindows& windows = setup.windows;
            const WindowPlanes window(frame_, planes, windows.first[i]);
            std::uint32_t places =
                window.met() & kWindows.places[windows.columns[i]][windows.rows[i]];
            for (; places != 0; places &= places - 1) {
                const auto place = static_cast<std::uint32_t>(__builtin_ctz(places));
                const std::uint32_t block =
                    windows.first[i] + place / kWindowSide * kGridSide + place % kWindowSide;
                won |= trace_pair(planes, window.at(place), block, first_candidate + i);
            }
            put_off_many(leaf, first_candidate);
        }
        return won;
    }

    /// Larger triangles, of `blocks`. Eight rows at a time are two words that one loop goes
    /// through, for an end of it costs as much as a pair.
    HWY_INLINE bool trace_large(const Leaf& leaf, const Setup& setup, std::uint32_t triangles,
                                const BlockSet<kWords>& blocks, std::uint32_t first_candidate) {
        bool won = false;
        for (; triangles != 0; triangles &= triangles - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(triangles));
            const GridPlanes planes(setup, i);
            const std::uint32_t left = setup.windows.first[i] % kGridSide;
            const std::uint32_t top = setup.windows.first[i] / kGridSide;
            RowPlanes grid(packet_, planes, ((2u << setup.windows.columns[i]) - 1) << left);
            const std::uint32_t rows = ((2u << setup.windows.rows[i]) - 1) << top;
            for (std::uint32_t row = top; rows >> row != 0; row += 8) {
                const std::uint32_t first = row * kGridSide;
                Window window = {0, grid.blocks_met(row, rows >> row, 0) & four_rows(blocks, row)};
                Window next = {64, 0};
                if (rows >> row >> 4 != 0)
                    next.blocks =
                        grid.blocks_met(row + 4, rows >> row >> 4, 64) & four_rows(blocks, row + 4);
                while ((window.blocks | next.blocks) != 0) {
                    if (window.blocks == 0) {
                        window = next;
                        next.blocks = 0;
                    }
                    const std::uint32_t place =
                        window.first + static_cast<std::uint32_t>(__builtin_ctzll(window.blocks));
                    won |= trace_pair(planes, grid.at(place), first + place, first_candidate + i);
                    window.blocks &= window.blocks - 1;
                }
            }
            put_off_many(leaf, first_candidate);
        }
        return won;
    }

    HWY_INLINE void put_off_many(const Leaf& leaf, std::uint32_t first_candidate) {
        if (HWY_UNLIKELY(open_count_ >= kManyOpen)) put_off(leaf, first_candidate);
    }

    /// Those of four rows of blocks from one on.
    static HWY_INLINE std::uint64_t four_rows(const BlockSet<kWords>& blocks, std::uint32_t row) {
        const std::uint32_t word = row / 4;
        const std::uint32_t shift = row % 4 * kGridSide;
        if (word >= kWords) return 0;
        const std::uint64_t after = word + 1 < kWords ? blocks.words[word + 1] : 0;
        return blocks.words[word] >> shift | after << 1 << (63 - shift);
    }

    /// Closest hits: each triangle against its blocks, which are few on a grid and quickly found.
    /// Triangles that are treated alike come together, so that fewer branches are guessed wrong.
    HWY_INLINE void trace_by_triangle(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                      const BlockSet<kWords>& blocks) {
        if (alive == 0) return;
        for (std::size_t w = 0; w < kWords; ++w) traced_.words[w] |= blocks.words[w];
        const auto first_candidate =
            static_cast<std::uint32_t>(packet_.hit_leaves.size() * kLeafTriangles);
        const GridWindows& windows = setup.windows;
        bool won = trace_few(leaf, setup, alive & windows.few, first_candidate);
        won |= trace_many(leaf, setup, alive & windows.fit & ~windows.few, first_candidate);
        won |= trace_large(leaf, setup, alive & ~windows.fit, blocks, first_candidate);
        if (HWY_UNLIKELY(open_count_ != 0)) put_off(leaf, first_candidate);
        if (won && first_candidate == packet_.hit_leaves.size() * kLeafTriangles)
            add_hit_leaf(packet_, leaf);
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
    DeferredRays deferred_;
    /// Pairs that a leaf has left open: of some rays from `ray` on and a triangle.
    struct Open {
        std::uint32_t ray, lanes, candidate;
    };
    static constexpr std::uint32_t kManyOpen = 64;
    Open open_[kManyOpen + kCameraRays / kLanes];
    std::uint32_t open_count_ = 0;
    /// The blocks of leaves that were visited since depths were found. A triangle may be held
    /// against others, too; of these too little is known until then.
    BlockSet<kWords> traced_ = {};
    /// The blocks of rays that are uncertain: what can be hit there matters to them for longer.
    BlockSet<kWords> uncertain_blocks_ = {};
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
