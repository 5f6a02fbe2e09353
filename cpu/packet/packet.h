// A packet: up to 64 x 64 rays with a common origin in blocks of 4 x 4, and what is known of each
// so far. Plain data between the packet's making, its traversal and its end; no SIMD types.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/interop/bvh_layout.h"
#include "common/interop/ray.h"

namespace morphray::cpu {

inline constexpr std::uint32_t kBlockSide = 4;
inline constexpr std::uint32_t kBlockRays = kBlockSide * kBlockSide;

/// A camera's packet: blocks row by row, of which a word of bits holds four rows.
inline constexpr std::uint32_t kCameraSide = 64;
inline constexpr std::uint32_t kGridSide = kCameraSide / kBlockSide;
inline constexpr std::uint32_t kGridBlocks = kGridSide * kGridSide;
inline constexpr std::uint32_t kCameraRays = kGridBlocks * kBlockRays;
static_assert(kGridSide == 16);

inline constexpr std::uint64_t kAllBlocks = ~std::uint64_t{0};

/// A point's packet: blocks in Morton order, so that four squares come after each other, in them
/// groups of 4 x 4 blocks, and in those quads of 2 x 2. As many blocks again may be made of rays
/// that are put together anew.
inline constexpr std::uint32_t kQuadBlocks = 4;
inline constexpr std::uint32_t kGroupBlocks = 16;
inline constexpr std::uint32_t kSquareSide = 32;
inline constexpr std::uint32_t kSquareRays = kSquareSide * kSquareSide;
inline constexpr std::uint32_t kSquareBlocks = kSquareRays / kBlockRays;
inline constexpr std::uint32_t kLightPacketSide = 2 * kSquareSide;
inline constexpr std::uint32_t kLightPacketRays = kLightPacketSide * kLightPacketSide;
inline constexpr std::uint32_t kLightPacketBlocks = kLightPacketRays / kBlockRays;
inline constexpr std::uint32_t kAllLightPacketBlocks = 2 * kLightPacketBlocks;
inline constexpr std::uint32_t kAllLightPacketRays = kAllLightPacketBlocks * kBlockRays;
inline constexpr std::uint32_t kLightPacketGroups = kAllLightPacketBlocks / kGroupBlocks;
inline constexpr std::uint32_t kLightPacketQuads = kAllLightPacketBlocks / kQuadBlocks;
static_assert(kLightPacketQuads == 128);

/// Index of the ray at (x, y) of a camera's packet: blocks row by row, rays of a block column by
/// column.
inline std::uint32_t camera_packet_ray(std::uint32_t x, std::uint32_t y) {
    const std::uint32_t block = (y / kBlockSide) * kGridSide + x / kBlockSide;
    return block * kBlockRays + (x % kBlockSide) * kBlockSide + y % kBlockSide;
}
/// What x and y add to the index of a point's ray: blocks in Morton order, rays of a block column
/// by column.
struct LightPacketPlaces {
    std::uint16_t x[kLightPacketSide]{}, y[kLightPacketSide]{};

    constexpr LightPacketPlaces() {
        for (std::uint32_t i = 0; i < kLightPacketSide; ++i) {
            std::uint32_t blocks = 0;
            for (std::uint32_t bit = 0; kBlockSide << bit < kLightPacketSide; ++bit)
                blocks |= (i / kBlockSide >> bit & 1) << 2 * bit;
            x[i] = static_cast<std::uint16_t>(blocks * kBlockRays + i % kBlockSide * kBlockSide);
            y[i] = static_cast<std::uint16_t>(2 * blocks * kBlockRays + i % kBlockSide);
        }
    }
};
inline constexpr LightPacketPlaces kLightPacketPlaces;

/// Index of the ray at (x, y) of a point's packet.
inline std::uint32_t light_packet_ray(std::uint32_t x, std::uint32_t y) {
    return std::uint32_t{kLightPacketPlaces.x[x]} + kLightPacketPlaces.y[y];
}

/// Rays of a block that start at one point, side by side: dir[axis][i] and tfar[i] are those of ray
/// i, as in Ray. There is none where tfar < 0.
struct alignas(64) SharedOriginRays {
    float dir[3][kBlockRays];
    float tfar[kBlockRays];

    static SharedOriginRays none() {
        SharedOriginRays rays{};
        std::fill_n(rays.tfar, kBlockRays, -1.0f);
        return rays;
    }

    bool has(std::size_t i) const { return tfar[i] >= 0; }
    vec3 direction(std::size_t i) const { return {dir[0][i], dir[1][i], dir[2][i]}; }
    Ray ray(vec3 org, std::size_t i) const { return {org, 0, direction(i), tfar[i]}; }

    /// Of the ray its direction and tfar; its tnear is 0.
    void set(std::size_t i, const Ray& ray) {
        for (int axis = 0; axis < 3; ++axis) dir[axis][i] = ray.dir[axis];
        tfar[i] = ray.tfar;
    }
};

/// How many squares rays of so many pixels need.
inline std::uint32_t light_packet_squares(std::uint32_t width, std::uint32_t height) {
    return (height > kSquareSide ? 2 : 0) + (width > kSquareSide ? 2 : 1);
}

/// A leaf of which a triangle won at least one ray, kept for the packet's end: the corners of its
/// triangles relative to the origin, side by side; rotated as shear_ray does for the packet's axis,
/// and times -1 where directions are negative on it. If axes are mixed, rotated for the first.
struct alignas(64) HitLeaf {
    float corner[3][3][kLeafTriangles];
    float prim_id[kLeafTriangles];  // bits
    const Leaf* leaf;

    HitLeaf() {}  // leaves all as it is: it is about to be filled
};

/// In place of a candidate, which is the index of its leaf among the packet's won leaves times
/// kLeafTriangles, plus its slot there.
inline constexpr std::uint32_t kNoCandidate = 0xFFFFFFFFu;

/// The middles of a camera's blocks in the packet's plane.
struct alignas(64) GridMiddles {
    float x[kGridBlocks]{}, y[kGridBlocks]{};

    constexpr GridMiddles() {
        constexpr float kFirst = 0.5f * kBlockSide - 0.5f * kCameraSide;
        for (std::uint32_t block = 0; block < kGridBlocks; ++block) {
            x[block] = kFirst + static_cast<float>(block % kGridSide * kBlockSide);
            y[block] = kFirst + static_cast<float>(block / kGridSide * kBlockSide);
        }
    }
};
inline constexpr GridMiddles kGridMiddles;

/// The rays of a camera's blocks in the packet's plane: x of those in a column of blocks, y of
/// those in a row.
struct alignas(64) GridRays {
    float x[kGridSide][kBlockRays]{}, y[kGridSide][kBlockRays]{};

    constexpr GridRays() {
        constexpr float kFirst = 0.5f - 0.5f * kCameraSide;
        for (std::uint32_t block = 0; block < kGridSide; ++block) {
            for (std::uint32_t ray = 0; ray < kBlockRays; ++ray) {
                x[block][ray] = kFirst + static_cast<float>(block * kBlockSide + ray / kBlockSide);
                y[block][ray] = kFirst + static_cast<float>(block * kBlockSide + ray % kBlockSide);
            }
        }
    }
};
inline constexpr GridRays kGridRays;

/// The places of a window of 4 x 4 blocks, from the first block's.
struct alignas(64) WindowBlocks {
    float x[16]{}, y[16]{};

    constexpr WindowBlocks() {
        for (std::uint32_t i = 0; i < 16; ++i) {
            x[i] = static_cast<float>(i % 4 * kBlockSide);
            y[i] = static_cast<float>(i / 4 * kBlockSide);
        }
    }
};
inline constexpr WindowBlocks kWindowBlocks;

/// The rays of a camera's block from its middle.
struct alignas(64) BlockPlaces {
    float x[kBlockRays]{}, y[kBlockRays]{};

    constexpr BlockPlaces() {
        constexpr float kFirst = 0.5f - 0.5f * kBlockSide;
        for (std::uint32_t ray = 0; ray < kBlockRays; ++ray) {
            x[ray] = kFirst + static_cast<float>(ray / kBlockSide);
            y[ray] = kFirst + static_cast<float>(ray % kBlockSide);
        }
    }
};
inline constexpr BlockPlaces kBlockPlaces;

/// In place of the axis: rays of one packet have their largest direction components on several.
inline constexpr std::uint32_t kMixedAxes = 3;

/// The packet's own projection: a point p relative to the origin has (x, y, z) = rows * p, and is
/// seen at (x / z, y / z). Every ray has z > 0. The unit of the plane is such that no ray is
/// farther than `reach` from its origin on either axis.
struct PacketFrame {
    vec3 org;
    float reach;
    double rows[3][3];
    float rows_f[3][3];
    /// Sums of the magnitudes of a row.
    float row_size[3];
    /// How far x, y of a ray, those of its pixel's middle if it is a camera's, may be from those of
    /// its exact direction.
    float ray_error;
    /// That of a camera, twice, with what is left for the rounding of sums.
    float grid_margin;
    /// How many columns and rows of a camera's blocks hold rays.
    std::uint32_t grid_columns, grid_rows;
    /// The largest extent of a camera's block in x and y together.
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
    /// in magnitude. A step of 1 in x or y measures at most `unit` in |x| + |y| + |z|, and at most
    /// `across` in |x| + |y| of the plane that the rule projects a ray of the packet to, if the ray
    /// has length 1 on its axis. per_volume is 1 / the volume of the cube of (1, 0, 0), (0, 1, 0),
    /// (0, 0, 1), and per_depth 1 / depth_least.
    std::uint32_t axis_count;
    float depth_rows[3][3];
    float depth_least, depth_most;
    float unit, across;
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

/// Loads that have the lower 12 bits of their address in common with a store before them may wait
/// for it. So packets, and what traces any hits of them, start on pages: which arrays collide is
/// then the same in each process, whatever addresses it is given.
inline constexpr std::size_t kPage = 4096;

/// In place of the index of a ray: there is none.
inline constexpr std::uint16_t kNoPlace = 0xFFFF;

struct alignas(kPage) Packet {
    PacketFrame frame;
    /// Camera rays are made where they are needed.
    CameraRays camera;
    /// Other rays are the caller's; where they go through the plane.
    const SharedOriginRays* rays;
    alignas(64) float x[kAllLightPacketRays], y[kAllLightPacketRays];
    /// 1/z of the best hit so far lies in [q_lower, q_upper]; a ray that wants no more has kDone in
    /// both. A point's have no q_upper.
    float q_lower[kAllLightPacketRays], q_upper[kCameraRays];
    /// Of each ray, or kNoCandidate.
    std::uint32_t candidate[kCameraRays];
    /// The least q_lower of a block: what is beyond that depth matters to none of its rays.
    float block_q[kAllLightPacketBlocks];
    /// Bounds of x, y of the active rays of a point's block; empty (lower > upper) where there are
    /// none.
    float block_lower_x[kAllLightPacketBlocks], block_upper_x[kAllLightPacketBlocks];
    float block_lower_y[kAllLightPacketBlocks], block_upper_y[kAllLightPacketBlocks];
    /// Likewise of a point's quads, and the least q_lower there.
    float quad_lower_x[kLightPacketQuads], quad_upper_x[kLightPacketQuads];
    float quad_lower_y[kLightPacketQuads], quad_upper_y[kLightPacketQuads];
    float quad_q[kLightPacketQuads];
    /// How many squares there are, and how many blocks were put together anew: kLightPacketBlocks
    /// and those after it.
    std::uint32_t square_count, moved_count;

    /// Of the rays of those blocks, where the caller has them, or kNoPlace.
    std::uint16_t place[kLightPacketRays];

    std::vector<HitLeaf> hit_leaves;
};

}  // namespace morphray::cpu
