// Any hits of a light packet: its way through the tree. The active part of the packet at a node is
// a set of quads, each of which takes one comparison with a box instead of four for its blocks.
// Boxes that concern few quads ask their rays, too: where triangles are small as the light sees
// them, most boxes lie between the rays. Only leaves look at blocks.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_TRAVERSAL_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_TRAVERSAL_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_TRAVERSAL_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_TRAVERSAL_INL_H
#endif

#include <hwy/highway.h>

#include <cassert>
#include <cstddef>
#include <cstdint>

#include "common/bvh/bvh.h"
#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/light/light_packet_blocks-inl.h"
#include "cpu/packet/light/light_packet_leaf-inl.h"
#include "cpu/packet/packet_node-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Marks the occluded rays of a packet as done.
class alignas(kPage) LightPacketTraversal {
public:
    LightPacketTraversal(const Bvh& bvh, LightPacket& packet)
        : bvh_(bvh), packet_(packet), occlusion_(packet) {}

    void run() {
        // The root concerns the whole packet.
        stack_[0] = {kAnyDepth,
                     0,
                     {{kAllBlocks, kAllBlocks}},
                     {-kWholePlane, kWholePlane, -kWholePlane, kWholePlane}};
        size_ = 1;
        while (size_ > 0) {
            const Entry entry = stack_[--size_];
            QuadSet quads = quads_beyond(packet_, entry.q, entry.quads);
            if (!quads.any()) continue;
            if ((entry.child & kLeafBit) == 0) {
                const std::size_t count = quads.count();
                if (count <= kFewQuads) {
                    quads = RaysWithin(packet_, entry.rectangle, entry.q).quads(quads);
                    if (!quads.any()) continue;
                }
                visit_node(bvh_.nodes[entry.child], quads, count <= kFewQuads);
            } else {
                occlusion_.trace(bvh_.leaves[entry.child & ~kLeafBit], entry.rectangle, entry.q,
                                 quads);
            }
        }
    }

private:
    /// A child to visit: it is seen in a rectangle (lower x, upper x, lower y, upper y) and no
    /// nearer than q (nearest_q), and may concern `quads`.
    struct Entry {
        float q;
        std::uint32_t child;
        QuadSet quads;
        float rectangle[4];
    };

    void visit_node(const Node& node, const QuadSet& quads, bool few) {
        NodeChildren children;
        std::uint32_t hits = project_node(packet_.frame, node, children);
        const Rectangles& r = children.rectangles;
        QuadSet quads_of[kWidth];
        std::uint32_t kept = 0;
        if (few) {
            kept = few_quads_in(packet_, r, children.q, hits, quads, quads_of);
        } else {
            for (; hits != 0; hits &= hits - 1) {
                const auto slot = static_cast<std::uint32_t>(__builtin_ctz(hits));
                assert(node.child[slot] != kEmptyChild);
                quads_of[slot] = quads_in(packet_, r, children.q[slot], slot, quads);
                kept |= (quads_of[slot].any() ? 1u : 0u) << slot;
            }
        }
        alignas(64) std::int32_t order[kWidth];
        order_of(children.q, order);
        for (std::uint32_t rest = kept; rest != 0; rest &= rest - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(rest));
            stack_[size_ + hwy::PopCount(kept & slots_before(order, order[slot]))] = {
                children.q[slot],
                node.child[slot],
                quads_of[slot],
                {r.lower_x[slot], r.upper_x[slot], r.lower_y[slot], r.upper_y[slot]}};
            prefetch_child(bvh_, node.child[slot]);
        }
        size_ += static_cast<std::uint32_t>(hwy::PopCount(kept));
    }

    /// Sets distinct numbers in the order of 1/z except for its last 4 bits: the bits of floats
    /// that are not negative, with the slot in the last bits.
    static HWY_INLINE void order_of(const float* q, std::int32_t* order) {
        for (std::size_t l = 0; l < kWidth; l += kLanes) {
            const auto bits = as_int(load(q + l));
            const auto slots = hn::Iota(kInts, static_cast<std::int32_t>(l));
            store((bits & splat(~15)) | slots, order + l);
        }
    }

    /// The children whose order is less than `own`: those farther away.
    static HWY_INLINE std::uint32_t slots_before(const std::int32_t* order, std::int32_t own) {
        std::uint32_t before = 0;
        for (std::size_t l = 0; l < kWidth; l += kLanes) {
            const auto is_before = load(order + l) < splat(own);
            before |= bits_of(float_mask(is_before)) << l;
        }
        return before;
    }

    const Bvh& bvh_;
    LightPacket& packet_;
    LeafOcclusion occlusion_;
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
