// The normals and albedos of what a camera packet shows, from the leaves that its rays hit: these
// are still in the caches, unlike the vertices of the mesh.
#include <hwy/highway.h>

#include <bit>
#include <cstddef>
#include <cstdint>

#include "common/base/aligned_vector.h"
#include "cpu/packet/camera/camera_packet_candidates-inl.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

class LeafNormals {
public:
    /// Finds those of a packet that has been traced.
    void find(const CameraPacket& packet, const Topology& topology) {
        has_degenerate_ = false;
        leaves_.resize(packet.hit_leaves.size());
        for (std::size_t i = 0; i < leaves_.size(); ++i)
            find(*packet.hit_leaves[i].leaf, topology, leaves_[i]);
    }

    bool empty() const { return leaves_.empty(); }

    /// True if a triangle has two parallel edges, so that its normal is undefined.
    bool has_degenerate() const { return has_degenerate_; }

    /// The unit normals, on the triangles' own side, of as many candidates as there are lanes, at
    /// least one, and their albedos. Those of lanes without a candidate are undefined.
    HWY_INLINE void look_up(const std::uint32_t* indices, lanes::Float3& normals,
                            UintVec& albedos) const {
        const UintVec candidates = load(indices);
        const auto places = hn::IndicesFromVec(kFloats, candidates & splat(kPartTriangles - 1));
        const auto at = [&](const float* values)
                            HWY_ATTR { return hn::TableLookupLanes(load(values), places); };
        const auto look_up_part = [&](std::uint32_t part, Mask own) HWY_ATTR {
            const LeafValues& leaf = leaves_[part / kLeafTriangles];
            const std::uint32_t first = part % kLeafTriangles;
            const lanes::Float3 n(at(leaf.normal[0] + first), at(leaf.normal[1] + first),
                                  at(leaf.normal[2] + first));
            normals = select(own, n, normals);
            albedos = select(uint_mask(own), as_uint(at(leaf.albedo + first)), albedos);
        };
        const Candidates found = find_candidates(indices);
        look_up_part(found.part, mask_of(~0u));
        for (std::uint32_t others = found.others; others != 0;) {
            const std::uint32_t part = part_of(indices[__builtin_ctz(others)]);
            const Mask own = candidates_in_part(candidates, part);
            look_up_part(part, own);
            others &= ~bits_of(own);
        }
    }

private:
    struct alignas(kCacheLine) LeafValues {
        float normal[3][kLeafTriangles];
        float albedo[kLeafTriangles];  // bits
    };

    void find(const Leaf& leaf, const Topology& topology, LeafValues& out) {
        const LeafColumns columns(leaf, [](FloatVec v, int) HWY_ATTR { return v; });
        const std::uint32_t count = corner_triangle_count(leaf.vertex[0].corners);
        for (std::size_t l = 0; l < kLeafTriangles; l += kLanes) {
            FloatVec at_corners[3][3];
            for (int axis = 0; axis < 3; ++axis)
                gather_corners(columns.values[axis], load(columns.corners + l), at_corners[axis]);
            const auto corner = [&](int k) HWY_ATTR {
                return lanes::Float3(at_corners[0][k], at_corners[1][k], at_corners[2][k]);
            };
            const lanes::Float3 across = cross3(corner(1) - corner(0), corner(2) - corner(0));
            const lanes::Float3 n = unit(across);
            store(n.x, out.normal[0] + l);
            store(n.y, out.normal[1] + l);
            store(n.z, out.normal[2] + l);
            const std::uint32_t used = ((1u << count) - 1) >> l & kLaneBits;
            has_degenerate_ |= (used & ~bits_of(largest_component(across) > zero())) != 0;
        }
        for (std::uint32_t i = 0; i < count; ++i)
            out.albedo[i] = std::bit_cast<float>(topology.albedo[leaf.prim_id[i]]);
    }

    AlignedVector<LeafValues> leaves_;
    bool has_degenerate_ = false;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
