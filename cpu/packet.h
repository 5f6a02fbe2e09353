// A packet: up to 32 x 32 rays with a common origin, as 64 blocks of 4 x 4, and what is known of
// each so far. Plain data between the packet's making, its traversal and its end; no SIMD types.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/interop/layout.h"
#include "common/interop/ray.h"

namespace morphray::cpu {

inline constexpr std::uint32_t kPacketSide = 32;
inline constexpr std::uint32_t kBlockSide = 4;
inline constexpr std::uint32_t kBlocksPerSide = kPacketSide / kBlockSide;
inline constexpr std::uint32_t kBlockRays = kBlockSide * kBlockSide;
inline constexpr std::uint32_t kPacketBlocks = kBlocksPerSide * kBlocksPerSide;
inline constexpr std::uint32_t kPacketRays = kPacketBlocks * kBlockRays;
inline constexpr std::uint64_t kAllBlocks = ~std::uint64_t{0};
static_assert(kPacketBlocks == 64);

/// Index of the ray at (x, y) of the packet's square: blocks row by row, rays of a block column by
/// column.
inline std::uint32_t packet_ray(std::uint32_t x, std::uint32_t y) {
    const std::uint32_t block = (y / kBlockSide) * kBlocksPerSide + x / kBlockSide;
    return block * kBlockRays + (x % kBlockSide) * kBlockSide + y % kBlockSide;
}

/// A leaf of which a triangle won at least one ray, kept for the packet's end: the corners of its
/// triangles relative to the origin, side by side; rotated as shear_ray does for the packet's axis,
/// and times -1 where directions are negative on it. If axes are mixed, rotated for the first.
struct alignas(64) WonLeaf {
    float corner[3][3][kLeafTriangles];
    float prim_id[kLeafTriangles];  // bits
    const Leaf* leaf;

    WonLeaf() {}  // leaves all as it is: it is about to be filled
};

/// In place of a winner, which is the index of its leaf among the packet's won leaves times
/// kLeafTriangles, plus its slot there.
inline constexpr std::uint32_t kNoWinner = 0xFFFFFFFFu;

/// The blocks in each range of columns or rows (GridRanges).
struct GridMasks {
    std::array<std::uint64_t, 81> columns{}, rows{};

    constexpr GridMasks() {
        for (std::uint32_t first = 0; first < kBlocksPerSide; ++first) {
            for (std::uint32_t last = first; last < kBlocksPerSide; ++last) {
                for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
                    const std::uint32_t column = block % kBlocksPerSide;
                    const std::uint32_t row = block / kBlocksPerSide;
                    const std::uint64_t bit = std::uint64_t{1} << block;
                    if (column >= first && column <= last) columns[first * 9 + last + 1] |= bit;
                    if (row >= first && row <= last) rows[first * 9 + last + 1] |= bit;
                }
            }
        }
    }
};
inline constexpr GridMasks kGridMasks;

/// The middles of a camera's blocks in the packet's plane.
struct alignas(64) GridMiddles {
    float x[kPacketBlocks]{}, y[kPacketBlocks]{};

    constexpr GridMiddles() {
        constexpr float kFirst = 0.5f * kBlockSide - 0.5f * kPacketSide;
        for (std::uint32_t block = 0; block < kPacketBlocks; ++block) {
            x[block] = kFirst + static_cast<float>(block % kBlocksPerSide * kBlockSide);
            y[block] = kFirst + static_cast<float>(block / kBlocksPerSide * kBlockSide);
        }
    }
};
inline constexpr GridMiddles kGridMiddles;

/// The rays of a camera's blocks in the packet's plane: x of those in a column of blocks, y of
/// those in a row.
struct alignas(64) GridRays {
    float x[kBlocksPerSide][kBlockRays]{}, y[kBlocksPerSide][kBlockRays]{};

    constexpr GridRays() {
        constexpr float kFirst = 0.5f - 0.5f * kPacketSide;
        for (std::uint32_t block = 0; block < kBlocksPerSide; ++block) {
            for (std::uint32_t ray = 0; ray < kBlockRays; ++ray) {
                x[block][ray] = kFirst + static_cast<float>(block * kBlockSide + ray / kBlockSide);
                y[block][ray] = kFirst + static_cast<float>(block * kBlockSide + ray % kBlockSide);
            }
        }
    }
};
inline constexpr GridRays kGridRays;

/// In place of the axis: rays of one packet have their largest direction components on several.
inline constexpr std::uint32_t kMixedAxes = 3;

/// The packet's own projection: a point p relative to the origin has (x, y, z) = rows * p, and is
/// seen at (x / z, y / z). Every ray has z > 0. The unit of the plane is such that the packet
/// measures about 32.
struct PacketFrame {
    vec3 org;
    double rows[3][3];
    float rows_f[3][3];
    /// Sums of the magnitudes of a row.
    float row_size[3];
    /// How far x, y of a ray, those of its pixel's middle if it is a camera's, may be from those of
    /// its exact direction.
    float ray_error;
    /// That of a camera, twice, with what is left for the rounding of sums.
    float grid_margin;
    /// The largest extent of a block in x and y together.
    float block_extent;
    /// Bounds of x, y of all active rays.
    float lower_x, upper_x, lower_y, upper_y;
    /// The dilation of boxes; and how far from exact the rule may place a hit, in z.
    float dilation, depth_error;
    /// That of the largest direction component of all rays, or kMixedAxes.
    std::uint32_t axis;
    /// The axes on which rays have their largest direction components, 0 if nothing is known. Of
    /// scene space: the coordinate on the k-th of these of a point at (x, y, z) is depth_rows[k] *
    /// (x, y, z); the largest component of a ray at z = 1 lies between depth_least and depth_most
    /// in magnitude. A step of 1 in x or y measures at most `unit` in |x| + |y| + |z|, per_volume
    /// is 1 / the volume of the cube of (1, 0, 0), (0, 1, 0), (0, 0, 1), and per_depth 1 /
    /// depth_least.
    std::uint32_t axis_count;
    float depth_rows[3][3];
    float depth_least, depth_most;
    float unit;
    float per_volume, per_depth;
};

/// In place of 1/z: nearer than anything, for rays that want no more; and nearer than any hit, for
/// what reaches to the eye.
inline constexpr float kDone = std::numeric_limits<float>::infinity();
inline constexpr float kAnyDepth = 3e38f;

/// What makes camera rays: corner + du x + dv y for the pixel (first_x, first_y) of a packet and
/// those after it. Axes may be rotated.
struct CameraRays {
    float corner[3], du[3], dv[3];
    float first_x, first_y;
};

/// In place of the index of a ray: there is none.
inline constexpr std::uint16_t kNoPlace = 0xFFFF;

struct alignas(64) Packet {
    PacketFrame frame;
    /// Camera rays are made where they are needed.
    CameraRays camera;
    /// Of other rays: directions as the hit rule takes them, tfar, and where they go through the
    /// plane.
    alignas(64) float dir[3][kPacketRays], tfar[kPacketRays];
    float x[kPacketRays], y[kPacketRays];
    /// 1/z of the best hit so far lies in [q_lower, q_upper]; a ray that wants no more has kDone in
    /// both.
    float q_lower[kPacketRays], q_upper[kPacketRays];
    /// Of each ray, or kNoWinner.
    std::uint32_t winner[kPacketRays];
    /// The least q_lower of a block: what is beyond that depth matters to none of its rays.
    float block_q[kPacketBlocks];
    /// Bounds of x, y of a block's active rays; empty (lower > upper) where there are none.
    float block_lower_x[kPacketBlocks], block_upper_x[kPacketBlocks];
    float block_lower_y[kPacketBlocks], block_upper_y[kPacketBlocks];

    /// Where the caller has the rays of blocks that were put together anew, or kNoPlace.
    std::uint16_t place[kPacketRays];

    std::vector<WonLeaf> won_leaves;
};

}  // namespace morphray::cpu
