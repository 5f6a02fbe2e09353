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
#include "cpu/rule_vectors-inl.h"

HWY_BEFORE_NAMESPACE();
namespace morphray::cpu {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Rectangles in the packet's plane, sixteen at a time.
struct alignas(64) Rectangles {
    float lower_x[16], upper_x[16], lower_y[16], upper_y[16];
};

/// The blocks whose rays may lie in a rectangle.
HWY_INLINE std::uint64_t blocks_in(const Packet& packet, const Rectangles& r, std::uint32_t i) {
    const Floats f;
    std::uint64_t blocks = 0;
    const VF lx = splat(r.lower_x[i]);
    const VF ux = splat(r.upper_x[i]);
    const VF ly = splat(r.lower_y[i]);
    const VF uy = splat(r.upper_y[i]);
    for (std::size_t b = 0; b < kPacketBlocks; b += hn::Lanes(f)) {
        const Mask x = hn::And(hn::Le(lx, hn::Load(f, packet.block_upper_x + b)),
                               hn::Ge(ux, hn::Load(f, packet.block_lower_x + b)));
        const Mask y = hn::And(hn::Le(ly, hn::Load(f, packet.block_upper_y + b)),
                               hn::Ge(uy, hn::Load(f, packet.block_lower_y + b)));
        blocks |= std::uint64_t{mask_bits(hn::And(x, y))} << b;
    }
    return blocks;
}

/// Likewise where the blocks are those of a camera's grid: column c holds x from 4 c - 15.5 to 4 c
/// - 12.5, up to the margin, rows alike. Turns rectangles into such columns and rows, as floats
/// between -1 and 8.
HWY_INLINE void to_grid(Rectangles& r, float margin) {
    const Floats f;
    const auto first = [&](float* x) {
        const VF c =
            hn::Ceil(hn::Mul(hn::Add(hn::Load(f, x), splat(12.5f - margin)), splat(0.25f)));
        hn::Store(hn::Max(hn::Min(c, splat(8.0f)), splat(0.0f)), f, x);
    };
    const auto last = [&](float* x) {
        const VF c =
            hn::Floor(hn::Mul(hn::Add(hn::Load(f, x), splat(15.5f + margin)), splat(0.25f)));
        hn::Store(hn::Max(hn::Min(c, splat(7.0f)), splat(-1.0f)), f, x);
    };
    for (std::size_t l = 0; l < 16; l += hn::Lanes(f)) {
        first(r.lower_x + l);
        last(r.upper_x + l);
        first(r.lower_y + l);
        last(r.upper_y + l);
    }
}

HWY_INLINE std::uint64_t blocks_of_grid(const Rectangles& r, std::uint32_t i) {
    const auto c0 = static_cast<int>(r.lower_x[i]);
    const auto c1 = static_cast<int>(r.upper_x[i]);
    const auto r0 = static_cast<int>(r.lower_y[i]);
    const auto r1 = static_cast<int>(r.upper_y[i]);
    if (c0 > c1 || r0 > r1) return 0;
    const std::uint64_t columns = (0xFFu << c0) & (0xFFu >> (7 - c1));
    const std::uint64_t rows =
        (~std::uint64_t{0} << (8 * r0)) & (~std::uint64_t{0} >> (8 * (7 - r1)));
    return (columns * 0x0101010101010101u) & rows;
}

/// The blocks with a ray that something at 1/z = q or less may still matter to.
HWY_INLINE std::uint64_t blocks_beyond(const Packet& packet, float q) {
    const Floats f;
    std::uint64_t blocks = 0;
    for (std::size_t b = 0; b < kPacketBlocks; b += hn::Lanes(f)) {
        blocks |= std::uint64_t{mask_bits(hn::Ge(splat(q), hn::Load(f, packet.block_q + b)))} << b;
    }
    return blocks;
}

/// 1/z for the nearest that a hit may be which the rule finds in a box or triangle from `z` on.
HWY_INLINE VF nearest_q(const PacketFrame& frame, VF z) {
    const VF near = hn::Sub(z, splat(frame.depth_error));
    const VF q = hn::Div(splat(1.00001f), hn::Max(near, splat(1e-20f)));
    return hn::IfThenElse(hn::Gt(near, hn::Zero(Floats())), q, splat(kAnyDepth));
}

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
    static constexpr bool kOnGrid = kQuery == Query::kClosest;

    HWY_INLINE std::uint64_t blocks_of(const Rectangles& rectangles, std::uint32_t i) const {
        return kOnGrid ? blocks_of_grid(rectangles, i) : blocks_in(packet_, rectangles, i);
    }

    /// Least and greatest of row k of the projection over boxes given relative to the origin.
    /// Products and sums are off by at most 2^-21 of row_size times the largest coordinate, which
    /// is added on both sides.
    HWY_INLINE void project_boxes(int k, const VF lower[3], const VF upper[3], VF size, VF& least,
                                  VF& most) const {
        least = hn::Zero(Floats());
        most = hn::Zero(Floats());
        for (int axis = 0; axis < 3; ++axis) {
            const float row = frame_.rows_f[k][axis];
            least = hn::MulAdd(splat(row), row >= 0 ? lower[axis] : upper[axis], least);
            most = hn::MulAdd(splat(row), row >= 0 ? upper[axis] : lower[axis], most);
        }
        const VF error = hn::Mul(splat(0x1p-21f * frame_.row_size[k]), size);
        least = hn::Sub(least, error);
        most = hn::Add(most, error);
    }

    void visit_node(const Entry& entry, Entry* stack, std::uint32_t& size) const {
        const Floats f;
        const Node& node = bvh_.nodes[entry.child];
        Rectangles rectangles;
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
            hn::Store(nearest_q(frame_, least[2]), f, q + l);
            hits |= mask_bits(keep) << l;
        }
        if constexpr (kOnGrid) to_grid(rectangles, frame_.grid_margin);
        const std::uint32_t base = size;
        for (; hits != 0; hits &= hits - 1) {
            const auto slot = static_cast<std::uint32_t>(__builtin_ctz(hits));
            if (node.child[slot] == kEmptyChild) break;
            const std::uint64_t blocks =
                entry.blocks & blocks_of(rectangles, slot) & blocks_beyond(packet_, q[slot]);
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

    /// Sixteen triangles of a leaf, set up: edge functions a x + b y + c of the packet's plane,
    /// positive inside; their bound; 1/z = sum * scale with an error of c0 + q (c1 + q
    /// depth_error).
    struct alignas(64) Setup {
        float a[3][16], b[3][16], c[3][16];
        float bound[16], scale[16], c0[16], c1[16], q[16];
        Rectangles rectangles;
    };

    void visit_leaf(std::uint32_t leaf_index, std::uint64_t blocks) {
        const Leaf& leaf = bvh_.leaves[leaf_index];
        Setup setup;
        std::uint32_t alive = set_up(leaf, setup);
        alive &= (1u << corner_triangle_count(leaf.vertex[0].corners)) - 1;
        if (HWY_UNLIKELY(has_invalid_vertex(leaf))) alive &= finite_triangles(leaf);
        if constexpr (kOnGrid) {
            to_grid(setup.rectangles, frame_.grid_margin);
            trace_by_triangle(leaf, setup, alive, blocks);
        } else {
            trace_by_block(leaf, setup, alive, blocks);
        }
    }

    static bool has_invalid_vertex(const Leaf& leaf) {
        for (const LeafVertex& v : leaf.vertex) {
            if (v.x > kSceneExtent) return true;
        }
        return false;
    }

    static std::uint32_t finite_triangles(const Leaf& leaf) {
        std::uint32_t finite = 0;
        for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
            float largest = -kSceneExtent;
            for (std::uint32_t k = 0; k < 3; ++k)
                largest = std::max(largest, leaf.vertex[corner(leaf.vertex[i].corners, k)].x);
            finite |= (largest <= kSceneExtent ? 1u : 0u) << i;
        }
        return finite;
    }

    void refresh_block(std::uint32_t block) {
        const Floats f;
        VF least = splat(kDone);
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            least = hn::Min(least, hn::Load(f, packet_.q_lower + block * kBlockRays + l));
        }
        packet_.block_q[block] = hn::GetLane(hn::MinOfLanes(f, least));
    }

    /// Sets up all triangles of a leaf; which of them may cover a ray of the packet.
    ///
    /// Vertices: v0, the leaf's first, is projected in double; the others by rows * (v - v0), off
    /// by at most 5 * 2^-24 row_size extent from the product and 4 * 2^-24 of the result from the
    /// sums. In x - X z and y - Y z for |X|, |Y| <= 17 that makes `error`, with the ray's own share
    /// and that of the rule, whose vertices are displaced by 2^-22 of their distance from the ray.
    /// Edge functions are taken in the middle (X0, Y0) of the triangle's rectangle inside the
    /// packet; no ray of a block that meets the rectangle is farther from there than half its
    /// extent and a block, so `reach` bounds |x - X z| + |y - Y z| of all vertices for all of them.
    /// Two vertices off by error each move an edge function by at most 4 error reach (twice the
    /// first-order term), and its own rounding, with that of a X0 + b Y0, by at most 2^-21 reach
    /// (reach + 64 z).
    HWY_INLINE std::uint32_t set_up(const Leaf& leaf, Setup& setup) const {
        const Floats f;
        alignas(64) float vx[16], vy[16], vz[16];
        alignas(64) std::uint32_t corners[16];
        const float extent = project_vertices(leaf, vx, vy, vz, corners);
        const float leaf_error =
            0x1p-21f * (frame_.row_size[0] + frame_.row_size[1] + 34 * frame_.row_size[2]) * extent;
        std::uint32_t alive = 0;
        for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
            VF x[3], y[3], z[3];
            gather_corners(vx, vy, vz, corners + l, x, y, z);
            alive |= mask_bits(set_up_triangles(x, y, z, leaf_error, setup, l)) << l;
        }
        return alive;
    }

    HWY_INLINE float project_vertices(const Leaf& leaf, float* vx, float* vy, float* vz,
                                      std::uint32_t* corners) const {
        const Floats f;
        // A vertex that is not finite is put where v0 is: its triangles are left out afterwards.
        const LeafVertex* first = leaf.vertex;
        while (first->x > kSceneExtent && first != leaf.vertex + kLeafVertices - 1) ++first;
        const LeafVertex& v0 = *first;
        const double p[3] = {double{v0.x} - frame_.org.x, double{v0.y} - frame_.org.y,
                             double{v0.z} - frame_.org.z};
        float h[3];
        for (int k = 0; k < 3; ++k) {
            h[k] = static_cast<float>(frame_.rows[k][0] * p[0] + frame_.rows[k][1] * p[1] +
                                      frame_.rows[k][2] * p[2]);
        }
        VF extent = hn::Zero(f);
        float* const out[3] = {vx, vy, vz};
        for (std::size_t l = 0; l < kLeafVertices; l += hn::Lanes(f)) {
            VF x, y, z, w;
            hn::LoadInterleaved4(f, &leaf.vertex[l].x, x, y, z, w);
            hn::Store(hn::BitCast(Words(), w), Words(), corners + l);
            const Mask finite = hn::Le(x, splat(kSceneExtent));
            x = hn::IfThenElseZero(finite, hn::Sub(x, splat(v0.x)));
            y = hn::IfThenElseZero(finite, hn::Sub(y, splat(v0.y)));
            z = hn::IfThenElseZero(finite, hn::Sub(z, splat(v0.z)));
            extent = hn::Max(extent, hn::Max(hn::Abs(x), hn::Max(hn::Abs(y), hn::Abs(z))));
            for (int k = 0; k < 3; ++k) {
                const float* row = frame_.rows_f[k];
                const VF sum = hn::MulAdd(
                    splat(row[0]), x,
                    hn::MulAdd(splat(row[1]), y, hn::MulAdd(splat(row[2]), z, splat(h[k]))));
                hn::Store(sum, f, out[k] + l);
            }
        }
        return hn::GetLane(hn::MaxOfLanes(f, extent));
    }

    HWY_INLINE void gather_corners(const float* vx, const float* vy, const float* vz,
                                   const std::uint32_t* corners, VF x[3], VF y[3], VF z[3]) const {
        const Floats f;
        const hn::RebindToSigned<Floats> ints;
        const VW packed = hn::Load(Words(), corners);
        const VW byte = hn::Set(Words(), 0xFFu);
        const VW slot[3] = {hn::And(packed, byte), hn::And(hn::ShiftRight<8>(packed), byte),
                            hn::And(hn::ShiftRight<16>(packed), byte)};
        for (int k = 0; k < 3; ++k) {
            if constexpr (hn::MaxLanes(Floats()) == 16) {
                const auto index = hn::IndicesFromVec(f, slot[k]);
                x[k] = hn::TableLookupLanes(hn::Load(f, vx), index);
                y[k] = hn::TableLookupLanes(hn::Load(f, vy), index);
                z[k] = hn::TableLookupLanes(hn::Load(f, vz), index);
            } else {
                const auto index = hn::BitCast(ints, slot[k]);
                x[k] = hn::GatherIndex(f, vx, index);
                y[k] = hn::GatherIndex(f, vy, index);
                z[k] = hn::GatherIndex(f, vz, index);
            }
        }
    }

    HWY_INLINE Mask set_up_triangles(const VF x[3], const VF y[3], const VF z[3], float leaf_error,
                                     Setup& setup, std::size_t l) const {
        const Floats f;
        const VF zero = hn::Zero(f);
        const VF half = splat(0.5f);
        const VF z_least = hn::Min(z[0], hn::Min(z[1], z[2]));
        const VF z_most = hn::Max(z[0], hn::Max(z[1], z[2]));
        const VF z_size = hn::Max(hn::Abs(z_least), hn::Abs(z_most));
        const VF z_error = hn::MulAdd(splat(0x1p-22f), z_size, splat(leaf_error));

        // The rectangle, where the triangle is well in front of the eye.
        const Mask in_front =
            hn::Gt(z_least, hn::MulAdd(splat(0x1p-10f), z_size, splat(16 * leaf_error)));
        const VF safe_least = hn::IfThenElse(in_front, z_least, splat(1.0f));
        const VF margin = hn::MulAdd(hn::Div(splat(2 * leaf_error), safe_least), splat(1.0f),
                                     splat(2 * frame_.ray_error + 0x1p-16f));
        VF rx[3], ry[3];
        for (int k = 0; k < 3; ++k) {
            const VF rz = hn::Div(splat(1.0f), hn::IfThenElse(in_front, z[k], splat(1.0f)));
            rx[k] = hn::Mul(x[k], rz);
            ry[k] = hn::Mul(y[k], rz);
        }
        const VF all = splat(1e6f);
        // Besides the margin: 2^-20 of the value for the rounding of division and sums.
        const auto lower = [&](const VF r[3]) {
            const VF v = hn::Min(r[0], hn::Min(r[1], r[2]));
            return hn::IfThenElse(in_front,
                                  hn::Sub(hn::NegMulAdd(splat(0x1p-20f), hn::Abs(v), v), margin),
                                  hn::Neg(all));
        };
        const auto upper = [&](const VF r[3]) {
            const VF v = hn::Max(r[0], hn::Max(r[1], r[2]));
            return hn::IfThenElse(in_front,
                                  hn::Add(hn::MulAdd(splat(0x1p-20f), hn::Abs(v), v), margin), all);
        };
        const VF lower_x = lower(rx);
        const VF upper_x = upper(rx);
        const VF lower_y = lower(ry);
        const VF upper_y = upper(ry);
        hn::Store(lower_x, f, setup.rectangles.lower_x + l);
        hn::Store(upper_x, f, setup.rectangles.upper_x + l);
        hn::Store(lower_y, f, setup.rectangles.lower_y + l);
        hn::Store(upper_y, f, setup.rectangles.upper_y + l);
        const VF cut_lower_x = hn::Max(lower_x, splat(frame_.lower_x));
        const VF cut_upper_x = hn::Min(upper_x, splat(frame_.upper_x));
        const VF cut_lower_y = hn::Max(lower_y, splat(frame_.lower_y));
        const VF cut_upper_y = hn::Min(upper_y, splat(frame_.upper_y));
        Mask meets =
            hn::And(hn::And(hn::Le(cut_lower_x, cut_upper_x), hn::Le(cut_lower_y, cut_upper_y)),
                    hn::Gt(hn::Add(z_most, z_error), zero));
        if constexpr (kOnGrid) {
            // Most small triangles cover no pixel's middle, x = k + 0.5 for whole k, at all.
            const VF above = splat(0.5f + frame_.grid_margin);
            const VF below = splat(0.5f - frame_.grid_margin);
            const auto covers = [&](VF low, VF high) {
                return hn::Le(hn::Ceil(hn::Sub(low, above)), hn::Floor(hn::Sub(high, below)));
            };
            meets = hn::And(meets, hn::And(covers(lower_x, upper_x), covers(lower_y, upper_y)));
        }

        const VF middle_x = hn::Mul(half, hn::Add(cut_lower_x, cut_upper_x));
        const VF middle_y = hn::Mul(half, hn::Add(cut_lower_y, cut_upper_y));
        VF px[3], py[3];
        VF size = zero;
        for (int k = 0; k < 3; ++k) {
            px[k] = hn::NegMulAdd(middle_x, z[k], x[k]);
            py[k] = hn::NegMulAdd(middle_y, z[k], y[k]);
            size = hn::Max(size, hn::Add(hn::Abs(px[k]), hn::Abs(py[k])));
        }
        const VF half_extent = hn::Mul(
            half, hn::Add(hn::Sub(cut_upper_x, cut_lower_x), hn::Sub(cut_upper_y, cut_lower_y)));
        const VF reach = hn::MulAdd(hn::Add(half_extent, splat(block_extent_)), z_size, size);
        const VF error =
            hn::MulAdd(splat(0x1p-21f), reach,
                       hn::MulAdd(splat(0x1p-16f + frame_.ray_error), z_size, splat(leaf_error)));
        const VF rounding =
            hn::Mul(splat(0x1p-21f), hn::Mul(reach, hn::MulAdd(splat(64.0f), z_size, reach)));
        const VF bound = hn::MulAdd(hn::Mul(splat(4.0f), error), hn::Add(reach, error), rounding);

        VF a[3], b[3], c[3];
        const auto edge = [&](int k, int i, int j) {
            a[k] = hn::MulSub(py[i], z[j], hn::Mul(z[i], py[j]));
            b[k] = hn::MulSub(z[i], px[j], hn::Mul(px[i], z[j]));
            c[k] = hn::MulSub(px[i], py[j], hn::Mul(py[i], px[j]));
        };
        edge(0, 1, 2);
        edge(1, 2, 0);
        edge(2, 0, 1);
        const VF det = hn::MulAdd(px[0], a[0], hn::MulAdd(py[0], b[0], hn::Mul(z[0], c[0])));
        const VF sign = hn::And(det, splat(-0.0f));
        const VF scale = hn::Div(splat(1.0f), hn::Max(hn::Abs(det), splat(1e-30f)));
        // What overflows (eyes and vertices very far away) leaves everything in doubt. All else
        // follows from the two, since reach bounds the vertices and 2^-21 reach^2 is a part of the
        // bound.
        const Mask sane = hn::And(hn::Lt(bound, splat(1e28f)), hn::Lt(hn::Abs(det), splat(1e34f)));
        hn::Store(hn::IfThenElseZero(sane, scale), f, setup.scale + l);
        hn::Store(hn::IfThenElse(sane, bound, splat(1e35f)), f, setup.bound + l);
        for (int k = 0; k < 3; ++k) {
            a[k] = hn::IfThenElseZero(sane, a[k]);
            b[k] = hn::IfThenElseZero(sane, b[k]);
            c[k] = hn::IfThenElseZero(sane, c[k]);
            const VF ak = hn::Xor(a[k], sign);
            const VF bk = hn::Xor(b[k], sign);
            const VF ck = hn::Xor(c[k], sign);
            hn::Store(ak, f, setup.a[k] + l);
            hn::Store(bk, f, setup.b[k] + l);
            hn::Store(hn::NegMulAdd(ak, middle_x, hn::NegMulAdd(bk, middle_y, ck)), f,
                      setup.c[k] + l);
        }
        store_depth_errors(a, b, hn::IfThenElseZero(sane, det), scale, error, rounding, z_size,
                           size, setup, l);
        hn::Store(nearest_q(frame_, hn::Sub(z_least, z_error)), f, setup.q + l);
        return meets;
    }

    /// 1/z is that of the plane through the projected vertices, up to rounding; displacing the
    /// vertices by `error` moves it by its gradient times that, while the displacement is small
    /// against the triangle. Where it is not, nothing is certain.
    HWY_INLINE void store_depth_errors(const VF a[3], const VF b[3], VF det, VF scale, VF error,
                                       VF rounding, VF z_size, VF size, Setup& setup,
                                       std::size_t l) const {
        const Floats f;
        const VF gradient = hn::Add(hn::Abs(hn::Add(hn::Add(a[0], a[1]), a[2])),
                                    hn::Abs(hn::Add(hn::Add(b[0], b[1]), b[2])));
        const VF steep = hn::Mul(hn::Mul(splat(8.0f), error), hn::Mul(gradient, scale));
        // Of det: products of size * size * z, nine of them.
        const VF det_error =
            hn::Mul(splat(0x1p-20f), hn::Mul(hn::Mul(size, size), hn::Mul(z_size, scale)));
        const VF c1 = hn::Add(splat(0x1p-17f), hn::Add(steep, det_error));
        const VF c0 = hn::Mul(hn::Mul(splat(4.0f), rounding), scale);
        const Mask doubtful =
            hn::Ge(hn::Mul(splat(16.0f), hn::Mul(error, hn::Mul(size, z_size))), hn::Abs(det));
        hn::Store(hn::IfThenElse(doubtful, splat(1e35f), c0), f, setup.c0 + l);
        hn::Store(hn::IfThenZeroElse(doubtful, c1), f, setup.c1 + l);
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
              scale(splat(setup.scale[i])),
              bound(splat(setup.bound[i])),
              error0(splat(setup.c0[i])),
              error1(splat(setup.c1[i])) {}

        VF a0, a1, a2, b0, b1, b2, c0, c1, c2;
        VF scale, bound, error0, error1;
    };

    /// One triangle against all rays of one block. Whether it wins any (closest hit only).
    HWY_INLINE bool trace_pair(const Planes& p, const Leaf& leaf, std::uint32_t i,
                               std::uint32_t block, std::uint32_t winner) {
        const Floats f;
        const Words words;
        bool won = false;
        for (std::size_t l = 0; l < kBlockRays; l += hn::Lanes(f)) {
            const std::size_t r = block * kBlockRays + l;
            const VF x = hn::Load(f, packet_.x + r);
            const VF y = hn::Load(f, packet_.y + r);
            const VF u = hn::MulAdd(p.a0, x, hn::MulAdd(p.b0, y, p.c0));
            const VF v = hn::MulAdd(p.a1, x, hn::MulAdd(p.b1, y, p.c1));
            const VF w = hn::MulAdd(p.a2, x, hn::MulAdd(p.b2, y, p.c2));
            const VF least = hn::Min(u, hn::Min(v, w));
            const VF q = hn::Mul(hn::Add(hn::Add(u, v), w), p.scale);
            const VF q_error =
                hn::MulAdd(q, hn::MulAdd(q, splat(frame_.depth_error), p.error1), p.error0);
            const VF q_lower = hn::Sub(q, q_error);
            const VF q_upper = hn::Add(q, q_error);
            const VF old_lower = hn::Load(f, packet_.q_lower + r);
            const VF old_upper = hn::Load(f, packet_.q_upper + r);
            const Mask sure = hn::And(hn::Gt(least, p.bound), hn::Gt(q_lower, old_upper));
            const Mask out = hn::Or(hn::Lt(least, hn::Neg(p.bound)), hn::Lt(q_upper, old_lower));
            if constexpr (kQuery == Query::kClosest) {
                hn::Store(hn::IfThenElse(sure, q_lower, old_lower), f, packet_.q_lower + r);
                hn::Store(hn::IfThenElse(sure, q_upper, old_upper), f, packet_.q_upper + r);
                const VW old = hn::Load(words, packet_.winner + r);
                hn::Store(hn::IfThenElse(hn::RebindMask(words, sure), hn::Set(words, winner), old),
                          words, packet_.winner + r);
                won |= !hn::AllFalse(f, sure);
            } else {
                hn::Store(hn::IfThenElse(sure, splat(kDone), old_lower), f, packet_.q_lower + r);
                hn::Store(hn::IfThenElse(sure, splat(kDone), old_upper), f, packet_.q_upper + r);
            }
            // A NaN, from an overflow, is neither.
            const Mask settled = hn::Or(sure, out);
            if (HWY_UNLIKELY(!hn::AllTrue(f, settled))) {
                std::uint32_t bits = mask_bits(hn::Not(settled));
                if constexpr (kQuery == Query::kAny) {
                    // Often the doubt is only whether the triangle lies before the ray's end, which
                    // is on it.
                    bits &= ~settle_depth(r, leaf, i, bits & mask_bits(hn::Gt(least, p.bound)));
                }
                for (; bits != 0; bits &= bits - 1) {
                    won |= ask_rule(static_cast<std::uint32_t>(r) +
                                        static_cast<std::uint32_t>(__builtin_ctz(bits)),
                                    leaf, i, winner);
                }
            }
        }
        return won;
    }

    /// Closest hits: each triangle against its blocks, which are few on a grid and quickly found.
    HWY_INLINE void trace_by_triangle(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                      std::uint64_t blocks) {
        std::uint64_t touched = 0;
        for (; alive != 0; alive &= alive - 1) {
            const auto i = static_cast<std::uint32_t>(__builtin_ctz(alive));
            std::uint64_t own =
                blocks & blocks_of_grid(setup.rectangles, i) & blocks_beyond(packet_, setup.q[i]);
            if (own == 0) continue;
            touched |= own;
            const Planes planes(setup, i);
            const auto winner = static_cast<std::uint32_t>(packet_.winners.size());
            bool won = false;
            for (; own != 0; own &= own - 1) {
                won |= trace_pair(planes, leaf, i, static_cast<std::uint32_t>(__builtin_ctzll(own)),
                                  winner);
            }
            if (won) add_winner(leaf, i);
        }
        for (; touched != 0; touched &= touched - 1)
            refresh_block(static_cast<std::uint32_t>(__builtin_ctzll(touched)));
    }

    /// Any hits: each block against the triangles that it meets; blocks lie anywhere, and some end
    /// early.
    HWY_INLINE void trace_by_block(const Leaf& leaf, const Setup& setup, std::uint32_t alive,
                                   std::uint64_t blocks) {
        const Floats f;
        for (; blocks != 0; blocks &= blocks - 1) {
            const auto block = static_cast<std::uint32_t>(__builtin_ctzll(blocks));
            std::uint32_t triangles = 0;
            for (std::size_t l = 0; l < kLeafTriangles; l += hn::Lanes(f)) {
                const Rectangles& rect = setup.rectangles;
                const Mask x = hn::And(
                    hn::Le(hn::Load(f, rect.lower_x + l), splat(packet_.block_upper_x[block])),
                    hn::Ge(hn::Load(f, rect.upper_x + l), splat(packet_.block_lower_x[block])));
                const Mask y = hn::And(
                    hn::Le(hn::Load(f, rect.lower_y + l), splat(packet_.block_upper_y[block])),
                    hn::Ge(hn::Load(f, rect.upper_y + l), splat(packet_.block_lower_y[block])));
                const Mask near = hn::Ge(hn::Load(f, setup.q + l), splat(packet_.block_q[block]));
                triangles |= mask_bits(hn::And(near, hn::And(x, y))) << l;
            }
            triangles &= alive;
            if (triangles == 0) continue;
            for (; triangles != 0; triangles &= triangles - 1) {
                const auto i = static_cast<std::uint32_t>(__builtin_ctz(triangles));
                trace_pair(Planes(setup, i), leaf, i, block, 0);
            }
            refresh_block(block);
        }
    }

    HWY_INLINE void add_winner(const Leaf& leaf, std::uint32_t i) {
        const std::uint32_t corners = leaf.vertex[i].corners;
        const auto vertex = [&](std::uint32_t k) {
            const LeafVertex& v = leaf.vertex[corner(corners, k)];
            return vec3(v.x, v.y, v.z);
        };
        packet_.winners.push_back({vertex(0), leaf.prim_id[i], vertex(1), 0, vertex(2), 0});
    }

    /// For some lanes of the rays from r on: whether the triangle occludes them, by the rule's
    /// plain path. The lanes for which that sufficed.
    HWY_INLINE std::uint32_t settle_depth(std::size_t r, const Leaf& leaf, std::uint32_t i,
                                          std::uint32_t lanes) {
        if (lanes == 0) return 0;
        const Floats f;
        const VF dir[3] = {hn::Load(f, packet_.dir_x + r), hn::Load(f, packet_.dir_y + r),
                           hn::Load(f, packet_.dir_z + r)};
        const VF org[3] = {splat(frame_.org.x), splat(frame_.org.y), splat(frame_.org.z)};
        VF corners[3][3];
        for (std::uint32_t k = 0; k < 3; ++k) {
            const LeafVertex& v = leaf.vertex[corner(leaf.vertex[i].corners, k)];
            corners[k][0] = splat(v.x);
            corners[k][1] = splat(v.y);
            corners[k][2] = splat(v.z);
        }
        std::uint32_t by_axis[3];
        lanes_by_axis(dir, lanes, by_axis);
        std::uint32_t settled = 0;
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            if (by_axis[axis] == 0) continue;
            VF o[3], d[3], vertex[3][3], t, u, v;
            Mask in_front;
            rotate(axis, org, o);
            rotate(axis, dir, d);
            for (int k = 0; k < 3; ++k) rotate(axis, corners[k], vertex[k]);
            const Mask sufficed =
                hit_fast(o, d, splat(0.25f * frame_.depth_error), vertex, t, u, v, in_front);
            const Mask in_range = hn::And(in_front, hn::Le(t, hn::Load(f, packet_.tfar + r)));
            const std::uint32_t own = mask_bits(sufficed) & by_axis[axis];
            settled |= own;
            for (std::uint32_t bits = own & mask_bits(in_range); bits != 0; bits &= bits - 1) {
                const std::size_t ray = r + static_cast<std::size_t>(__builtin_ctz(bits));
                packet_.q_lower[ray] = packet_.q_upper[ray] = kDone;
            }
        }
        return settled;
    }

    /// The rule for one ray and triangle, where the bounds leave a doubt. Whether the triangle
    /// wins.
    HWY_NOINLINE bool ask_rule(std::uint32_t r, const Leaf& leaf, std::uint32_t i,
                               std::uint32_t winner) {
        const Ray ray = packet_.ray(r);
        const ShearedRay sheared = shear_ray(ray.org, ray.dir);
        const std::uint32_t corners = leaf.vertex[i].corners;
        const auto vertex = [&](std::uint32_t k) {
            const LeafVertex& v = leaf.vertex[corner(corners, k)];
            return vec3(v.x, v.y, v.z);
        };
        TriangleHit hit;
        if (!intersect_triangle(sheared, ray.tnear, ray.tfar, vertex(0), vertex(1), vertex(2), hit))
            return false;
        if (kQuery == Query::kAny) {
            packet_.q_lower[r] = packet_.q_upper[r] = kDone;
            return true;
        }
        if (packet_.winner[r] != kNoWinner) {
            const Winner& best = packet_.winners[packet_.winner[r]];
            TriangleHit best_hit;
            intersect_triangle(sheared, ray.tnear, ray.tfar, best.a, best.b, best.c, best_hit);
            if (!wins(hit.t, leaf.prim_id[i], best_hit.t, best.prim_id)) return false;
        }
        const float q = 1.0f / (hit.t * packet_.z_per_t[r]);
        packet_.q_lower[r] = q * (1 - 0x1p-16f);
        packet_.q_upper[r] = q * (1 + 0x1p-16f);
        packet_.winner[r] = winner;
        return true;
    }

    const Bvh& bvh_;
    Packet& packet_;
    const PacketFrame& frame_;
    std::uint32_t size_ = 0;
    Entry stack_[kMaxStack];
    // A block's extent in x and y together, and a little: how far a ray may be from a rectangle
    // that its block meets.
    float block_extent_ = packet_.frame.block_extent;
};

}  // namespace HWY_NAMESPACE
}  // namespace morphray::cpu
HWY_AFTER_NAMESPACE();

#endif
