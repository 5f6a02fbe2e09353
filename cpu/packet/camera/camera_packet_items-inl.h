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
/// of up to kPlaces blocks, and what the rays of any block add to them. The bounds of TriangleSetup
/// cover the rounding of these sums (lab/proofs/packet_edges.g, packet_slant.g).
template <std::size_t kPlaces>
class BlockPlanes {
public:
    HWY_INLINE explicit BlockPlanes(const GridPlanes& p) : planes_(p) {
        for (std::size_t i = 0; i < kParts; ++i) {
            const FloatVec x = load(kBlockPlaces.x + i * kLanes);
            const FloatVec y = load(kBlockPlaces.y + i * kLanes);
            more_[0][i] = mul_add(p.a0, x, p.b0 * y);
            more_[1][i] = mul_add(p.a1, x, p.b1 * y);
            more_[2][i] = mul_add(p.a2, x, p.b2 * y);
            more_[3][i] = mul_add(p.depth_a, x, p.depth_b * y);
        }
    }

    struct Values {
        const BlockPlanes& planes;
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

    const GridPlanes& planes() const { return planes_; }

protected:
    /// Sets the edge functions in the middles of as many blocks as there are lanes. most: what a
    /// ray of a block may add to them. Returns which of the blocks have a ray that may be inside.
    HWY_INLINE Mask set_edges(std::size_t place, FloatVec u, FloatVec v, FloatVec w,
                              const FloatVec most[3]) {
        store(u, middle_[0] + place);
        store(v, middle_[1] + place);
        store(w, middle_[2] + place);
        const FloatVec least = min3(u + most[0], v + most[1], w + most[2]);
        return least >= -planes_.bound;
    }
    HWY_INLINE void set_depth(std::size_t place, FloatVec q) { store(q, middle_[3] + place); }

    /// How much larger a x + b y is at a ray of a block than in its middle, at most.
    static HWY_INLINE FloatVec most_in_block(const CameraFrame& frame, FloatVec a, FloatVec b) {
        const FloatVec half = splat(0.5f * (kBlockSide - 1) + frame.grid_margin);
        return (abs(a) + abs(b)) * half;
    }

private:
    static constexpr std::size_t kParts = kBlockRays / kLanes;

    const GridPlanes& planes_;
    FloatVec more_[4][kParts];
    alignas(64) float middle_[4][kPlaces];
};

/// BlockPlanes of a window of 4 x 4 blocks, row by row.
class WindowPlanes : public BlockPlanes<16> {
public:
    HWY_INLINE WindowPlanes(const CameraFrame& frame, const GridPlanes& p, std::uint32_t first)
        : BlockPlanes(p) {
        const FloatVec most[3] = {most_in_block(frame, p.a0, p.b0),
                                  most_in_block(frame, p.a1, p.b1),
                                  most_in_block(frame, p.a2, p.b2)};
        for (std::size_t l = 0; l < 16; l += kLanes) {
            const FloatVec x = splat(kGridMiddles.x[first]) + load(kWindowBlocks.x + l);
            const FloatVec y = splat(kGridMiddles.y[first]) + load(kWindowBlocks.y + l);
            const FloatVec u = mul_add(p.a0, x, mul_add(p.b0, y, p.c0));
            const FloatVec v = mul_add(p.a1, x, mul_add(p.b1, y, p.c1));
            const FloatVec w = mul_add(p.a2, x, mul_add(p.b2, y, p.c2));
            met_ |= bits_of(set_edges(l, u, v, w, most)) << l;
            set_depth(l, p.depth(x, y));
        }
    }

    /// The places of the blocks with a ray that may be inside, as bits.
    std::uint32_t met() const { return met_; }

private:
    std::uint32_t met_ = 0;
};

/// BlockPlanes of eight rows of blocks, four of them at a time.
class RowPlanes : public BlockPlanes<8 * kGridSide> {
public:
    HWY_INLINE RowPlanes(const CameraPacket& packet, const GridPlanes& p, std::uint32_t columns)
        : BlockPlanes(p), packet_(packet), columns_(columns * kEachRow) {
        const CameraFrame& frame = packet.frame;
        for (std::size_t i = 0; i < kVectors; ++i) {
            const FloatVec x = load(kGridMiddles.x + i * kLanes);
            u_[i] = mul_add(p.a0, x, p.c0);
            v_[i] = mul_add(p.a1, x, p.c1);
            w_[i] = mul_add(p.a2, x, p.c2);
            q_[i] = mul_add(p.depth_a, x, p.depth_c);
        }
        most_[0] = most_in_block(frame, p.a0, p.b0);
        most_[1] = most_in_block(frame, p.a1, p.b1);
        most_[2] = most_in_block(frame, p.a2, p.b2);
        most_q_ = most_in_block(frame, p.depth_a, p.depth_b) + p.error;
    }

    /// Returns the blocks with a ray that may hit the triangle nearer than its candidate, as a word
    /// of four rows of the grid from first_row on. rows: the rows to look at, which are the first
    /// ones, as bits. place: where the values of the first block go.
    HWY_INLINE std::uint64_t blocks_met(std::uint32_t first_row, std::uint32_t rows,
                                        std::size_t place) {
        constexpr float kFirst = 0.5f * kBlockSide - 0.5f * kCameraSide;
        const GridPlanes& p = planes();
        std::uint64_t met = 0;
        for (std::uint32_t i = 0; i < 4 && (rows >> i & 1) != 0; ++i) {
            const std::uint32_t row = first_row + i;
            const FloatVec y = splat(kFirst + static_cast<float>(row * kBlockSide));
            for (std::size_t k = 0; k < kVectors; ++k) {
                const std::size_t l = i * kGridSide + k * kLanes;
                const Mask inside =
                    set_edges(place + l, mul_add(p.b0, y, u_[k]), mul_add(p.b1, y, v_[k]),
                              mul_add(p.b2, y, w_[k]), most_);
                const FloatVec q = mul_add(p.depth_b, y, q_[k]);
                set_depth(place + l, q);
                const float* const block_q = packet_.block_q + first_row * kGridSide + l;
                const Mask near = q + most_q_ >= load(block_q);
                met |= std::uint64_t{bits_of(inside & near)} << l;
            }
        }
        return met & columns_;
    }

private:
    static constexpr std::size_t kVectors = kGridSide / kLanes;

    const CameraPacket& packet_;
    std::uint64_t columns_;
    FloatVec u_[kVectors], v_[kVectors], w_[kVectors], q_[kVectors];
    FloatVec most_[3], most_q_;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
