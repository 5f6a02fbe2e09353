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

#include <cstddef>
#include <cstdint>

#include "cpu/packet/light/light_packet.h"
#include "cpu/packet/light/light_packet_blocks-inl.h"
#include "cpu/packet/light/light_packet_leaf-inl.h"
#include "cpu/packet/packet_traversal-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// Marks the occluded rays of a packet as done. A part is the quads that a box may concern, and the
/// rectangle (lower x, upper x, lower y, upper y) that it is seen in.
class alignas(kPage) LightWalk {
public:
    struct Part {
        QuadSet quads;
        float rectangle[4];
    };

    explicit LightWalk(LightPacket& packet) : packet_(packet), occlusion_(packet) {}

    static Part whole() {
        return {{{kAllBlocks, kAllBlocks}}, {-kWholePlane, kWholePlane, -kWholePlane, kWholePlane}};
    }
    const PacketFrame& frame() const { return packet_.frame; }

    HWY_INLINE bool narrow(float q, bool is_node, Part& part) const {
        part.quads = quads_beyond(packet_, q, part.quads);
        if (is_node && has_few(part))
            part.quads = RaysWithin(packet_, part.rectangle, q).quads(part.quads);
        return part.quads.any();
    }

    HWY_INLINE std::uint32_t find_parts(const NodeChildren& children, std::uint32_t slots,
                                        const Part& part, Part* parts) const {
        const Rectangles& r = children.rectangles;
        QuadSet quads_of[kWidth];
        std::uint32_t kept = 0;
        if (has_few(part)) {
            kept = few_quads_in(packet_, r, children.q, slots, part.quads, quads_of);
        } else {
            for (; slots != 0; slots &= slots - 1) {
                const auto slot = static_cast<std::uint32_t>(__builtin_ctz(slots));
                quads_of[slot] = quads_in(packet_, r, children.q[slot], slot, part.quads);
                kept |= (quads_of[slot].any() ? 1u : 0u) << slot;
            }
        }
        for (std::uint32_t rest = kept; rest != 0; rest &= rest - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(rest));
            parts[slot] = {quads_of[slot],
                           {r.lower_x[slot], r.upper_x[slot], r.lower_y[slot], r.upper_y[slot]}};
        }
        return kept;
    }

    HWY_INLINE bool visit_leaf(const Leaf& leaf, float q, const Part& part) {
        occlusion_.trace(leaf, part.rectangle, q, part.quads);
        return true;
    }

private:
    static HWY_INLINE bool has_few(const Part& part) { return part.quads.count() <= kFewQuads; }

    LightPacket& packet_;
    LeafOcclusion occlusion_;
};

/// Marks the occluded rays of a packet as done.
HWY_INLINE void trace_light_packet(const Bvh& bvh, LightPacket& packet) {
    LightWalk walk(packet);
    PacketTraversal<LightWalk> traversal(bvh, walk);
    if (traversal.start(LightWalk::whole())) traversal.run();
}

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
