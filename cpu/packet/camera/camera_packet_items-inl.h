// Set-up triangles against blocks of a camera packet: which (triangle, block) items need a test,
// and the edge functions and 1/z at a block's rays.

#if defined(MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_ITEMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_ITEMS_INL_H
#undef MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_ITEMS_INL_H
#else
#define MORPHRAY_CPU_PACKET_CAMERA_CAMERA_PACKET_ITEMS_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "cpu/packet/camera/camera_packet.h"
#include "cpu/packet/camera/camera_packet_blocks-inl.h"
#include "cpu/packet/packet_triangles-inl.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// A set-up triangle in registers, with the error of its 1/z.
struct GridPlanes : Planes {
    HWY_INLINE GridPlanes(const CameraTriangles& triangles, std::uint32_t i)
        : Planes(triangles, i), error(splat(triangles.error[i])) {}

    FloatVec error;
};

/// The values of a triangle at a block's rays: the least edge function, whether an unoriented
/// triangle may be hit, and 1/z at as many rays as there are lanes, from l on.
struct GridValues {
    const GridPlanes& planes;
    std::uint32_t block;

    HWY_INLINE FloatVec least_edge(std::size_t l) const { return planes.least_edge(x(l), y(l)); }
    HWY_INLINE Mask may_be_inside(std::size_t l) const { return planes.may_be_inside(x(l), y(l)); }
    HWY_INLINE FloatVec depth(std::size_t l) const { return planes.depth(x(l), y(l)); }

private:
    HWY_INLINE FloatVec x(std::size_t l) const { return load(kGridRays.x[block % kGridSide] + l); }
    HWY_INLINE FloatVec y(std::size_t l) const { return load(kGridRays.y[block / kGridSide] + l); }
};

/// The same values for a triangle that meets many blocks: its edge functions and 1/z in the middles
/// of the blocks of eight rows, four of them at a time, and what the rays of any block add to them.
/// The bounds of TriangleSetup cover the rounding of these sums (lab/proofs/packet_edges.g,
/// packet_slant.g).
class RowPlanes {
public:
    HWY_INLINE RowPlanes(const CameraPacket& packet, const GridPlanes& p, std::uint32_t columns)
        : packet_(packet), planes_(p), columns_(columns * kEachRow) {
        for (std::size_t i = 0; i < kBlockRays / kLanes; ++i) {
            const FloatVec x = load(kBlockPlaces.x + i * kLanes);
            const FloatVec y = load(kBlockPlaces.y + i * kLanes);
            more_[0][i] = mul_add(p.a0, x, p.b0 * y);
            more_[1][i] = mul_add(p.a1, x, p.b1 * y);
            more_[2][i] = mul_add(p.a2, x, p.b2 * y);
            more_[3][i] = mul_add(p.depth_a, x, p.depth_b * y);
        }
        for (std::size_t i = 0; i < kVectors; ++i) {
            const FloatVec x = load(kGridMiddles.data() + i * kLanes);
            at_column_[0][i] = mul_add(p.a0, x, p.c0);
            at_column_[1][i] = mul_add(p.a1, x, p.c1);
            at_column_[2][i] = mul_add(p.a2, x, p.c2);
            at_column_[3][i] = mul_add(p.depth_a, x, p.depth_c);
        }
        most_[0] = most_in_block(p.a0, p.b0);
        most_[1] = most_in_block(p.a1, p.b1);
        most_[2] = most_in_block(p.a2, p.b2);
        most_q_ = most_in_block(p.depth_a, p.depth_b) + p.error;
    }

    struct Values {
        const RowPlanes& planes;
        std::size_t place;

        HWY_INLINE FloatVec least_edge(std::size_t l) const {
            return min3(value(0, l), value(1, l), value(2, l));
        }
        HWY_INLINE FloatVec depth(std::size_t l) const { return value(3, l); }

    private:
        HWY_INLINE FloatVec value(int k, std::size_t l) const {
            return planes.more_[k][l / kLanes] + splat(planes.middle_[k][place]);
        }
    };
    HWY_INLINE Values at(std::size_t place) const { return {*this, place}; }

    /// Returns the blocks with a ray that may hit the triangle nearer than its candidate, as a word
    /// of four rows of the grid from first_row on. rows: the rows to look at, which are the first
    /// ones, as bits. place: where the values of the first block go.
    HWY_INLINE std::uint64_t blocks_met(std::uint32_t first_row, std::uint32_t rows,
                                        std::size_t place) {
        const GridPlanes& p = planes_;
        std::uint64_t met = 0;
        for (std::uint32_t i = 0; i < 4 && (rows >> i & 1) != 0; ++i) {
            const FloatVec y = splat(kGridMiddles[first_row + i]);
            for (std::size_t k = 0; k < kVectors; ++k) {
                const std::size_t l = i * kGridSide + k * kLanes;
                const FloatVec u = mul_add(p.b0, y, at_column_[0][k]);
                const FloatVec v = mul_add(p.b1, y, at_column_[1][k]);
                const FloatVec w = mul_add(p.b2, y, at_column_[2][k]);
                const FloatVec q = mul_add(p.depth_b, y, at_column_[3][k]);
                store(u, middle_[0] + place + l);
                store(v, middle_[1] + place + l);
                store(w, middle_[2] + place + l);
                store(q, middle_[3] + place + l);
                const FloatVec least = min3(u + most_[0], v + most_[1], w + most_[2]);
                const Mask inside = least >= -p.bound;
                const Mask near = q + most_q_ >= load(packet_.block_q + first_row * kGridSide + l);
                met |= std::uint64_t{bits_of(inside & near)} << l;
            }
        }
        return met & columns_;
    }

private:
    static constexpr std::size_t kVectors = kGridSide / kLanes;

    /// How much larger a x + b y is at a ray of a block than in its middle, at most.
    HWY_INLINE FloatVec most_in_block(FloatVec a, FloatVec b) const {
        const FloatVec half = splat(0.5f * (kBlockSide - 1) + packet_.frame.grid_margin);
        return (abs(a) + abs(b)) * half;
    }

    const CameraPacket& packet_;
    const GridPlanes& planes_;
    std::uint64_t columns_;
    FloatVec more_[4][kBlockRays / kLanes];
    FloatVec at_column_[4][kVectors];
    FloatVec most_[3], most_q_;
    alignas(64) float middle_[4][8 * kGridSide];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
