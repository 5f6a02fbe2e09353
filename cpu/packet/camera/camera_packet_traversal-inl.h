// Closest hits of a camera packet: its way through the tree.
//
// Based on: I. Wald, S. Boulos, P. Shirley. Ray Tracing Deformable Scenes Using Dynamic Bounding
// Volume Hierarchies. ACM TOG 26(1), 2007: packets far larger than a vector, one conservative test
// of the whole packet per node, ordered descent. Changed: sixteen children are tested at once in
// the packet's own projection; the active part of the packet is a mask of blocks, culled by depth
// block by block; and triangles are set up sixteen at a time as homogeneous edge functions (M.
// Olano, T. Greer. Triangle scan conversion using 2D homogeneous coordinates. 1997), so that no
// vertex beside or behind the eye needs clipping.
//
// The bounds here never contradict the hit rule (common/interop/hit_rule.h): edge functions and 1/z
// carry a bound of their distance from what the rule computes, they decide only beyond that bound,
// and the rule resolves the rest. So any arithmetic may be used, fused or not.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H
#endif

#include <hwy/highway.h>

#include <cassert>
#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_blocks-inl.h"
#include "cpu/packet/camera/camera_packet_deferred-inl.h"
#include "cpu/packet/camera/camera_packet_hit_leaves-inl.h"
#include "cpu/packet/camera/camera_packet_items-inl.h"
#include "cpu/packet/packet_node-inl.h"
#include "cpu/packet/triangle_setup-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Finds the closest candidates of a camera packet's rays.
class CameraPacketTraversal {
public:
    CameraPacketTraversal(const Bvh& bvh, CameraPacket& packet)
        : bvh_(bvh), packet_(packet), frame_(packet.frame), deferred_(packet) {}

    /// Visits the root, which needs only the packet's frame. Returns whether it has children that
    /// the packet may hit.
    bool start() {
        BlockSet all;
        for (std::uint64_t& word : all.words) word = kAllBlocks;
        packet_.leaf_count = 0;
        visit_node(0, all, pixels_of_packet(), stack_, size_);
        return size_ > 0;
    }

    /// Visits what start() found, until every ray has its closest candidate. With kWhereItPays,
    /// returns false, leaving the rays without answers, if the first leaves are smaller than
    /// pixels.
    bool run(PacketUse use) {
        Entry* stack = stack_;
        std::uint32_t& size = size_;
        while (size > 0) {
            // Read in the pieces in which it was written: one load would wait for all of them.
            const Entry& top = stack[--size];
            const float q = top.q;
            const std::uint32_t child = top.child;
            PixelRectangle pixels = top.pixels;
            BlockSet blocks;
            for (std::size_t w = 0; w < kGridWords; ++w) blocks.words[w] = top.blocks.words[w];
            const bool is_node = (child & kLeafBit) == 0;
            if (has_few_blocks(blocks)) {
                if (!any_ray_matters(q, blocks, pixels)) continue;
            } else {
                if (is_node) find_depths();
                if (!still_matters(q, blocks)) continue;
            }
            if (is_node) {
                visit_node(child, blocks, pixels, stack, size);
            } else {
                if (packet_.leaf_count < kFirstLeaves) {
                    pixels_of_leaves_ += pixels.count();
                } else if (packet_.leaf_count == kFirstLeaves && use == PacketUse::kWhereItPays &&
                           pixels_of_leaves_ < kFirstLeaves * kFewPixels) {
                    return false;
                }
                ++packet_.leaf_count;
                visit_leaf(child & ~kLeafBit, blocks, pixels);
            }
        }
        resolve();
        return true;
    }

private:
    /// A packet is given up if its first leaves concern fewer pixels than kFewPixels each
    /// (lab/notes/cpu_tracer.md).
    static constexpr std::uint32_t kFirstLeaves = 32;
    static constexpr std::uint32_t kFewPixels = 2;

    PixelRectangle pixels_of_packet() const {
        const auto last = [](std::uint32_t blocks) {
            return static_cast<std::uint8_t>(blocks * kBlockSide - 1);
        };
        return {0, last(frame_.grid_columns), 0, last(frame_.grid_rows)};
    }

    /// A child to visit.
    struct alignas(64) Entry {
        BlockSet blocks;
        float q;  // nearest_q of the box
        std::uint32_t child;
        PixelRectangle pixels;  // that the box may meet
    };

    /// Blocks of the packet: bit b is block first + b.
    struct Window {
        std::uint32_t first;
        std::uint64_t blocks;
    };

    /// Removes the blocks of an entry whose rays all have closer hits. Returns whether any remain.
    /// Blocks with uncertain rays may have closer hits than is known: if only such blocks remain,
    /// their rays are resolved first.
    HWY_INLINE bool still_matters(float q, BlockSet& blocks) {
        std::uint64_t any = keep_near(q, blocks);
        std::uint64_t certain = 0;
        for (std::size_t w = 0; w < kGridWords; ++w)
            certain |= blocks.words[w] & ~uncertain_blocks_.words[w];
        if (HWY_UNLIKELY(certain == 0 && any != 0)) {
            resolve();
            find_depths();
            any = keep_near(q, blocks);
        }
        return any != 0;
    }

    /// With more blocks, testing their rays costs more than it saves (lab/notes/cpu_tracer.md).
    static constexpr std::size_t kFewBlocks = 4;

    static HWY_INLINE bool has_few_blocks(const BlockSet& blocks) {
        std::size_t count = 0;
        for (const std::uint64_t word : blocks.words) count += hwy::PopCount(word);
        return count <= kFewBlocks;
    }

    /// still_matters() ray by ray, for few blocks: where triangles are smaller than pixels, most
    /// rays of a block are far from the box, or hit something nearer. Removes pixels, too.
    HWY_INLINE bool any_ray_matters(float q, BlockSet& blocks, PixelRectangle& pixels) {
        const std::uint64_t certain = keep_rays(q, blocks, pixels);
        if (HWY_UNLIKELY(certain == 0 && !pixels.empty())) {
            resolve();
            keep_rays(q, blocks, pixels);
        }
        return !pixels.empty();
    }

    /// Returns the blocks that remain and have no uncertain rays, of any word.
    HWY_INLINE std::uint64_t keep_rays(float q, BlockSet& blocks, PixelRectangle& pixels) const {
        std::uint64_t certain = 0;
        PixelRectangle kept = PixelRectangle::none();
        for (std::uint32_t w = 0; w < kGridWords; ++w) {
            std::uint64_t keep = 0;
            for (std::uint64_t rest = blocks.words[w]; rest != 0; rest &= rest - 1) {
                const std::uint32_t block =
                    64 * w + static_cast<std::uint32_t>(__builtin_ctzll(rest));
                const std::uint32_t rays = rays_beyond(packet_, q, block, pixels);
                if (rays == 0) continue;
                keep |= rest & -rest;
                add_rays(block, rays, kept);
            }
            blocks.words[w] = keep;
            certain |= keep & ~uncertain_blocks_.words[w];
        }
        pixels = kept;
        return certain;
    }

    HWY_INLINE std::uint64_t keep_near(float q, BlockSet& blocks) const {
        std::uint64_t any = 0;
        for (std::size_t w = 0; w < kGridWords; ++w) {
            blocks.words[w] &= blocks_beyond(packet_, q, w);
            any |= blocks.words[w];
        }
        return any;
    }

    void visit_node(std::uint32_t index, const BlockSet& among, const PixelRectangle& pixels,
                    Entry* stack, std::uint32_t& size) const {
        const Node& node = bvh_.nodes[index];
        NodeChildren children;
        std::uint32_t hits = project_node(frame_, node, children);
        const float* q = children.q;
        GridRanges ranges;
        to_grid(frame_.grid_margin, pixels, children.rectangles, ranges);
        const std::uint32_t base = size;
        for (; hits != 0; hits &= hits - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(hits));
            assert(node.child[slot] != kEmptyChild);
            BlockSet blocks;
            if (!blocks_of_grid(ranges.columns[slot], ranges.rows[slot], among, blocks)) continue;
            std::uint32_t place = size++;
            for (; place > base && stack[place - 1].q > q[slot]; --place)
                stack[place] = stack[place - 1];
            stack[place] = {blocks, q[slot], node.child[slot], ranges.pixels[slot]};
            prefetch_child(bvh_, node.child[slot]);
        }
    }

    void visit_leaf(std::uint32_t leaf_index, const BlockSet& blocks,
                    const PixelRectangle& pixels) {
        const Leaf& leaf = bvh_.leaves[leaf_index];
        CameraTriangles triangles;
        const std::uint32_t alive = TriangleSetup<true>(frame_, pixels).run(leaf, triangles);
        if (alive == 0) return;
        trace_by_triangle(leaf, triangles, alive, blocks);
    }

    /// Tests one (triangle, block) item: a triangle against all rays of a block. Returns whether it
    /// becomes the closest candidate of any ray for certain. A triangle that is hit for certain
    /// bounds the depth of further hits, though it may be uncertain whether it is the closest.
    template <class Values>
    HWY_INLINE bool trace_item(const GridPlanes& p, const Values& values, std::uint32_t block,
                               std::uint32_t candidate) {
        CameraPacket& packet = packet_;
        bool any_closer = false;
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec lower = load(packet.q_lower + r);
            const FloatVec upper = load(packet.q_upper + r);
            const FloatVec least = values.least_edge(l);
            const FloatVec q = values.depth(l);
            const Mask inside = least > p.bound;
            const FloatVec own_lower = zero_unless(inside, q - p.error);
            const FloatVec own_upper = q + p.error;
            const Mask is_closer = own_lower > upper;
            const Mask is_rejected = (least < -p.bound) | (own_upper < lower);
            store(max(own_lower, lower), packet.q_lower + r);
            store(select(is_closer, own_upper, upper), packet.q_upper + r);
            store_where(is_closer, candidate, packet.candidate + r);
            any_closer |= !none(is_closer);
            const Mask certain = is_closer | is_rejected;
            if (HWY_UNLIKELY(!all(certain)))
                uncertain_[uncertain_count_++] = {static_cast<std::uint32_t>(r), bits_of(!certain),
                                                  candidate};
        }
        return any_closer;
    }

    /// Defers what a leaf has left uncertain.
    HWY_NOINLINE void defer(const Leaf& leaf, std::uint32_t first_candidate) {
        if (first_candidate == packet_.hit_leaves.size() * kLeafTriangles)
            add_hit_leaf(packet_, leaf);
        for (std::uint32_t i = 0; i < uncertain_count_; ++i) {
            const UncertainRays& rays = uncertain_[i];
            deferred_.add(rays.first, rays.lanes, rays.candidate);
            const std::size_t block = rays.first / kBlockRays;
            uncertain_blocks_.words[block / 64] |= std::uint64_t{1} << block % 64;
            if (deferred_.many()) resolve();
        }
        uncertain_count_ = 0;
    }

    /// Resolves all deferred rays by the rule.
    HWY_NOINLINE void resolve() {
        deferred_.resolve(traced_);
        uncertain_blocks_ = {};
    }

    /// The blocks that the rectangle of triangle i meets, if they fit into a window.
    static HWY_INLINE Window window_of(const CameraTriangles& triangles, std::uint32_t i) {
        const GridWindows& windows = triangles.windows;
        return {windows.first[i], kWindows.blocks[windows.columns[i]][windows.rows[i]]};
    }

    /// Traces triangles `few` that meet few blocks. Returns whether any is closer than a candidate.
    /// The blocks of the next triangle are found before this one is traced.
    HWY_INLINE bool trace_few(const Leaf& leaf, const CameraTriangles& triangles, std::uint32_t few,
                              std::uint32_t first_candidate) {
        if (few == 0) return false;
        bool any_closer = false;
        auto i = static_cast<std::uint32_t>(__builtin_ctz(few));
        Window window = window_of(triangles, i);
        while (few != 0) {
            few &= few - 1;
            const std::uint32_t next =
                few != 0 ? static_cast<std::uint32_t>(__builtin_ctz(few)) : i;
            const Window next_window = window_of(triangles, next);
            const GridPlanes planes(triangles, i);
            for (std::uint64_t blocks = window.blocks; blocks != 0; blocks &= blocks - 1) {
                const std::uint32_t block =
                    window.first + static_cast<std::uint32_t>(__builtin_ctzll(blocks));
                any_closer |=
                    trace_item(planes, GridValues{planes, block}, block, first_candidate + i);
            }
            defer_if_many(leaf, first_candidate);
            i = next;
            window = next_window;
        }
        return any_closer;
    }

    /// Traces triangles `many` that meet more blocks of a window.
    HWY_INLINE bool trace_many(const Leaf& leaf, const CameraTriangles& triangles,
                               std::uint32_t many, std::uint32_t first_candidate) {
        bool any_closer = false;
        for (; many != 0; many &= many - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(many));
            const GridPlanes planes(triangles, i);
            const GridWindows& windows = triangles.windows;
            const WindowPlanes window(frame_, planes, windows.first[i]);
            std::uint32_t places =
                window.met() & kWindows.places[windows.columns[i]][windows.rows[i]];
            for (; places != 0; places &= places - 1) {
                const auto place = static_cast<std::uint32_t>(__builtin_ctz(places));
                const std::uint32_t block =
                    windows.first[i] + place / kWindowSide * kGridSide + place % kWindowSide;
                any_closer |= trace_item(planes, window.at(place), block, first_candidate + i);
            }
            defer_if_many(leaf, first_candidate);
        }
        return any_closer;
    }

    /// Traces triangles `large` that meet more blocks than a window holds, against those of
    /// `blocks`. Eight rows at a time are two words, which one loop processes: the end of a loop,
    /// which is mispredicted, costs as much as an item.
    HWY_INLINE bool trace_large(const Leaf& leaf, const CameraTriangles& triangles,
                                std::uint32_t large, const BlockSet& blocks,
                                std::uint32_t first_candidate) {
        bool any_closer = false;
        const GridWindows& windows = triangles.windows;
        for (; large != 0; large &= large - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(large));
            const GridPlanes planes(triangles, i);
            const std::uint32_t left = windows.first[i] % kGridSide;
            const std::uint32_t top = windows.first[i] / kGridSide;
            RowPlanes grid(packet_, planes, ((2u << windows.columns[i]) - 1) << left);
            const std::uint32_t rows = ((2u << windows.rows[i]) - 1) << top;
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
                    any_closer |=
                        trace_item(planes, grid.at(place), first + place, first_candidate + i);
                    window.blocks &= window.blocks - 1;
                }
            }
            defer_if_many(leaf, first_candidate);
        }
        return any_closer;
    }

    /// Traces unoriented triangles against these blocks; rays that may hit them are deferred.
    HWY_NOINLINE void trace_unoriented(const Leaf& leaf, const CameraTriangles& triangles,
                                       std::uint32_t unoriented, const BlockSet& blocks,
                                       std::uint32_t first_candidate) {
        for (; unoriented != 0; unoriented &= unoriented - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(unoriented));
            const GridPlanes planes(triangles, i);
            for (std::uint32_t w = 0; w < kGridWords; ++w) {
                for (std::uint64_t rest = blocks.words[w]; rest != 0; rest &= rest - 1) {
                    const std::uint32_t block =
                        64 * w + static_cast<std::uint32_t>(__builtin_ctzll(rest));
                    const GridValues values = {planes, block};
                    for (std::uint32_t l = 0; l < kBlockRays; l += kLanes) {
                        const std::uint32_t uncertain = bits_of(values.may_be_inside(l));
                        if (HWY_LIKELY(uncertain == 0)) continue;
                        uncertain_[uncertain_count_++] = {block * kBlockRays + l, uncertain,
                                                          first_candidate + i};
                    }
                    defer_if_many(leaf, first_candidate);
                }
            }
        }
    }

    HWY_INLINE void defer_if_many(const Leaf& leaf, std::uint32_t first_candidate) {
        if (HWY_UNLIKELY(uncertain_count_ >= kManyUncertain)) defer(leaf, first_candidate);
    }

    /// The blocks of four rows from `row` on, as a word.
    static HWY_INLINE std::uint64_t four_rows(const BlockSet& blocks, std::uint32_t row) {
        const std::uint32_t word = row / 4;
        const std::uint32_t shift = row % 4 * kGridSide;
        if (word >= kGridWords) return 0;
        const std::uint64_t after = word + 1 < kGridWords ? blocks.words[word + 1] : 0;
        return blocks.words[word] >> shift | after << 1 << (63 - shift);
    }

    /// Traces each triangle against its blocks, which are few on a grid and quickly found.
    /// Triangles of one kind follow each other, so that fewer branches are mispredicted.
    HWY_INLINE void trace_by_triangle(const Leaf& leaf, const CameraTriangles& triangles,
                                      std::uint32_t alive, const BlockSet& blocks) {
        for (std::size_t w = 0; w < kGridWords; ++w) traced_.words[w] |= blocks.words[w];
        const auto first_candidate =
            static_cast<std::uint32_t>(packet_.hit_leaves.size() * kLeafTriangles);
        const GridWindows& windows = triangles.windows;
        const std::uint32_t unoriented = alive & triangles.unoriented;
        if (HWY_UNLIKELY(unoriented != 0)) {
            trace_unoriented(leaf, triangles, unoriented, blocks, first_candidate);
            alive &= ~unoriented;
        }
        bool any_closer = trace_few(leaf, triangles, alive & windows.few, first_candidate);
        any_closer |=
            trace_many(leaf, triangles, alive & windows.fit & ~windows.few, first_candidate);
        any_closer |= trace_large(leaf, triangles, alive & ~windows.fit, blocks, first_candidate);
        if (HWY_UNLIKELY(uncertain_count_ != 0)) defer(leaf, first_candidate);
        if (any_closer && first_candidate == packet_.hit_leaves.size() * kLeafTriangles)
            add_hit_leaf(packet_, leaf);
    }

    /// Updates the depths of the traced blocks.
    void find_depths() {
        for (std::uint32_t w = 0; w < kGridWords; ++w) {
            std::uint64_t blocks = traced_.words[w];
            for (auto count = static_cast<int>(hwy::PopCount(blocks)); count > 0; count -= 4) {
                std::uint32_t four[4];
                for (std::uint32_t& block : four) {
                    block = 64 * w + static_cast<std::uint32_t>(__builtin_ctzll(blocks));
                    const std::uint64_t rest = blocks & (blocks - 1);
                    blocks = rest != 0 ? rest : blocks;
                }
                find_four_depths(packet_, four);
            }
        }
        traced_ = {};
    }

    const Bvh& bvh_;
    CameraPacket& packet_;
    const CameraFrame& frame_;
    DeferredRays deferred_;
    /// Rays `lanes` from `first` on and a triangle that is uncertain about them.
    struct UncertainRays {
        std::uint32_t first, lanes, candidate;
    };
    static constexpr std::uint32_t kManyUncertain = 64;
    UncertainRays uncertain_[kManyUncertain + kCameraRays / kLanes];
    std::uint32_t uncertain_count_ = 0;
    /// The blocks of the leaves visited since depths were found. A triangle may be traced against
    /// other blocks as well: their depths are not updated, and cull less.
    BlockSet traced_ = {};
    /// The blocks with deferred rays, whose depths cull less until these are resolved.
    BlockSet uncertain_blocks_ = {};
    /// The pixels that the first leaves concern.
    std::uint32_t pixels_of_leaves_ = 0;
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
