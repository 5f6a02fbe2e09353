// Closest hits of a camera packet: its way through the tree. The active part of the packet at a
// node is a set of blocks, culled by depth block by block.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_TRAVERSAL_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_blocks-inl.h"
#include "cpu/packet/camera/camera_packet_leaf-inl.h"
#include "cpu/packet/packet_node-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Finds the closest candidates of a camera packet's rays. A part is the blocks, and the pixels,
/// that a box may concern.
class CameraWalk {
public:
    struct Part {
        BlockSet blocks;
        PixelRectangle pixels;
    };

    /// kWhereItPays: the walk ends, leaving the rays without answers, if the first leaves are
    /// smaller than pixels.
    CameraWalk(CameraPacket& packet, PacketUse use) : packet_(packet), use_(use), leaves_(packet) {
        packet.leaf_count = 0;
    }

    Part whole() const {
        const auto last = [](std::uint32_t blocks) {
            return static_cast<std::uint8_t>(blocks * kBlockSide - 1);
        };
        const CameraFrame& frame = packet_.frame;
        Part all = {{}, {0, last(frame.grid_columns), 0, last(frame.grid_rows)}};
        for (std::uint64_t& word : all.blocks.words) word = kAllBlocks;
        return all;
    }
    const PacketFrame& frame() const { return packet_.frame; }

    HWY_INLINE bool narrow(float q, bool is_node, Part& part) {
        if (has_few_blocks(part.blocks)) return any_ray_matters(q, part.blocks, part.pixels);
        if (is_node) leaves_.find_depths();
        return still_matters(q, part.blocks);
    }

    HWY_INLINE std::uint32_t find_parts(const NodeChildren& children, std::uint32_t slots,
                                        const Part& part, Part* parts) const {
        GridRanges ranges;
        to_grid(packet_.frame.grid_margin, part.pixels, children.rectangles, ranges);
        std::uint32_t kept = 0;
        for (; slots != 0; slots &= slots - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(slots));
            if (!blocks_of_grid(ranges.columns[slot], ranges.rows[slot], part.blocks,
                                parts[slot].blocks))
                continue;
            parts[slot].pixels = ranges.pixels[slot];
            kept |= 1u << slot;
        }
        return kept;
    }

    HWY_INLINE bool visit_leaf(const Leaf& leaf, float /*q*/, const Part& part) {
        if (packet_.leaf_count < kFirstLeaves) {
            pixels_of_leaves_ += part.pixels.count();
        } else if (packet_.leaf_count == kFirstLeaves && use_ == PacketUse::kWhereItPays &&
                   pixels_of_leaves_ < kFirstLeaves * kFewPixels) {
            return false;
        }
        ++packet_.leaf_count;
        leaves_.trace(leaf, part.blocks, part.pixels);
        return true;
    }

    /// Gives the rays that are still uncertain their closest candidates.
    void finish() { leaves_.resolve(); }

private:
    /// A packet is given up if its first leaves concern fewer pixels than kFewPixels each
    /// (lab/notes/cpu_tracer.md).
    static constexpr std::uint32_t kFirstLeaves = 32;
    static constexpr std::uint32_t kFewPixels = 2;

    /// Removes the blocks of a part whose rays all have closer hits. Returns whether any remain.
    /// Blocks with uncertain rays may have closer hits than is known: if only such blocks remain,
    /// their rays are resolved first.
    HWY_INLINE bool still_matters(float q, BlockSet& blocks) {
        std::uint64_t any = keep_near(q, blocks);
        std::uint64_t certain = 0;
        for (std::size_t w = 0; w < kGridWords; ++w)
            certain |= blocks.words[w] & ~leaves_.uncertain_blocks().words[w];
        if (HWY_UNLIKELY(certain == 0 && any != 0)) {
            leaves_.resolve();
            leaves_.find_depths();
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
            leaves_.resolve();
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
            certain |= keep & ~leaves_.uncertain_blocks().words[w];
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

    CameraPacket& packet_;
    PacketUse use_;
    CameraLeaves leaves_;
    /// The pixels that the first leaves concern.
    std::uint32_t pixels_of_leaves_ = 0;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
