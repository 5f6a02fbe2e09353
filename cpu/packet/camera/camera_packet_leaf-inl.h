// Closest hits of a camera packet in a leaf: its triangles against blocks of rays.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_LEAF_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_LEAF_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_LEAF_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_blocks-inl.h"
#include "cpu/packet/camera/camera_packet_candidates-inl.h"
#include "cpu/packet/camera/camera_packet_items-inl.h"
#include "cpu/packet/camera/deferred_rays-inl.h"
#include "cpu/packet/triangle_setup-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Finds the closest candidates of a camera packet's rays in leaves.
class CameraLeaves {
public:
    explicit CameraLeaves(CameraPacket& packet)
        : packet_(packet), frame_(packet.frame), deferred_(packet) {}

    /// Tests a leaf, whose box may concern some blocks and, of their rays, those in some pixels.
    /// Traces each triangle against its blocks, which are few on a grid and quickly found.
    /// Triangles of one kind follow each other, so that fewer branches are mispredicted.
    HWY_INLINE void trace(const Leaf& leaf, const BlockSet& blocks, const PixelRectangle& pixels) {
        CameraTriangles triangles;
        std::uint32_t alive = TriangleSetup<true>(frame_, pixels).run(leaf, triangles);
        if (alive == 0) return;
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
        any_closer |= trace_more(leaf, triangles, alive & ~windows.few, blocks, first_candidate);
        if (HWY_UNLIKELY(uncertain_count_ != 0)) defer(leaf, first_candidate);
        if (any_closer && first_candidate == packet_.hit_leaves.size() * kLeafTriangles)
            add_hit_leaf(packet_, leaf);
    }

    /// Resolves all deferred rays by the rule.
    HWY_NOINLINE void resolve() {
        deferred_.resolve(traced_);
        uncertain_blocks_ = {};
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

    /// The blocks with deferred rays, whose depths cull less until these are resolved.
    const BlockSet& uncertain_blocks() const { return uncertain_blocks_; }

private:
    /// Blocks of the packet: bit b is block first + b.
    struct Window {
        std::uint32_t first;
        std::uint64_t blocks;
    };

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

    /// The blocks that the rectangle of triangle i meets, if they are few.
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

    /// Traces triangles `many` that meet more blocks, against those of `blocks`. Eight rows at a
    /// time are two words, which one loop processes: the end of a loop, which is mispredicted,
    /// costs as much as an item.
    HWY_INLINE bool trace_more(const Leaf& leaf, const CameraTriangles& triangles,
                               std::uint32_t many, const BlockSet& blocks,
                               std::uint32_t first_candidate) {
        bool any_closer = false;
        const GridWindows& windows = triangles.windows;
        for (; many != 0; many &= many - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(many));
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
    BlockSet uncertain_blocks_ = {};
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
