// A camera packet: up to 64 x 64 camera rays on a grid of pixels, and the closest candidate of
// each. Plain data without SIMD types.
#pragma once

#include <cstdint>
#include <vector>

#include "common/bvh/node.h"
#include "common/interop/camera.h"
#include "cpu/packet/packet_frame.h"

namespace mray::cpu {

/// Blocks are stored row by row; a word of bits holds four rows of blocks.
inline constexpr std::uint32_t kCameraSide = 64;
inline constexpr std::uint32_t kGridSide = kCameraSide / kBlockSide;
inline constexpr std::uint32_t kGridBlocks = kGridSide * kGridSide;
inline constexpr std::uint32_t kGridWords = kGridBlocks / 64;
inline constexpr std::uint32_t kCameraRays = kGridBlocks * kBlockRays;
static_assert(kGridSide == 16);

/// Returns the index of the ray at (x, y): blocks row by row, the rays of a block column by column.
inline std::uint32_t camera_packet_ray(std::uint32_t x, std::uint32_t y) {
    const std::uint32_t block = (y / kBlockSide) * kGridSide + x / kBlockSide;
    return block * kBlockRays + (x % kBlockSide) * kBlockSide + y % kBlockSide;
}

/// Places in the packet's plane, whose unit is a pixel: the middles of the columns of blocks, or of
/// the rows; the rays of a block relative to its middle; and all rays, x by column of blocks, y by
/// row of blocks.
struct alignas(64) GridPlaces {
    float middle[kGridSide]{};
    float offset_x[kBlockRays]{}, offset_y[kBlockRays]{};
    float x[kGridSide][kBlockRays]{}, y[kGridSide][kBlockRays]{};

    constexpr GridPlaces() {
        for (std::uint32_t ray = 0; ray < kBlockRays; ++ray) {
            constexpr float kFirst = 0.5f - 0.5f * kBlockSide;
            offset_x[ray] = kFirst + static_cast<float>(ray / kBlockSide);
            offset_y[ray] = kFirst + static_cast<float>(ray % kBlockSide);
        }
        for (std::uint32_t block = 0; block < kGridSide; ++block) {
            constexpr float kFirst = 0.5f * kBlockSide - 0.5f * kCameraSide;
            middle[block] = kFirst + static_cast<float>(block * kBlockSide);
            for (std::uint32_t ray = 0; ray < kBlockRays; ++ray) {
                x[block][ray] = middle[block] + offset_x[ray];
                y[block][ray] = middle[block] + offset_y[ray];
            }
        }
    }
};
inline constexpr GridPlaces kGrid;

/// Blocks of a camera packet as bits, four rows of blocks a word.
struct BlockSet {
    std::uint64_t words[kGridWords];
};

/// Pixels of a packet: the first and the last column, and the first and the last row.
struct PixelRectangle {
    std::uint8_t first_x, last_x, first_y, last_y;

    std::uint32_t count() const { return (last_x - first_x + 1u) * (last_y - first_y + 1u); }
};

/// Stands for a candidate: the ray has none. A candidate is triangle_at() of the index of its leaf
/// in hit_leaves and its slot in the leaf.
inline constexpr std::uint32_t kNoCandidate = 0xFFFFFFFFu;

/// A leaf with a candidate, kept until the packet is finished. corner[k][axis] holds corner k of
/// each triangle relative to the origin: rotated as shear_ray rotates for the packet's axis, and
/// negated if directions are negative on it. With kMixedAxes they are rotated for axis 0.
struct alignas(64) HitLeaf {
    PerTriangle<float> corner[3][3];
    PerTriangle<float> prim_id;  // bits
    const Leaf* leaf;

    HitLeaf() {}  // uninitialized: add_hit_leaf() fills it
};

/// The camera's frame, whose unit is a pixel and whose origin is the middle of the 64 x 64 square.
struct CameraFrame : PacketFrame {
    /// Twice ray_error, and room for the rounding of sums.
    float grid_margin;
    std::uint32_t grid_columns, grid_rows;
    /// The largest extent of a block in x and y together, margins included.
    float block_extent;
};

/// Directions of the rays of a tile, by axis and by camera_packet_ray(), canonical. Absent
/// rays have finite ones.
struct alignas(64) StoredDirections {
    float d[3][kCameraRays];
};

struct alignas(kPage) CameraPacket {
    CameraFrame frame;
    /// Where directions come from: `stored`, or `camera` if it is null.
    Camera camera;
    const StoredDirections* stored = nullptr;
    /// The camera's pixel of ray 0.
    std::uint32_t first_x, first_y;
    /// By ray. 1/z of the closest hit so far lies in [q_lower, q_upper]; 0: none. A ray that needs
    /// no further test has kDone in both.
    alignas(64) float q_lower[kCameraRays];
    float q_upper[kCameraRays];
    /// The closest candidate of each ray, or kNoCandidate.
    std::uint32_t candidate[kCameraRays];
    /// The least q_lower of each block: nothing with a smaller 1/z concerns any of its rays.
    float block_q[kGridBlocks];

    std::vector<HitLeaf> hit_leaves;
    std::uint32_t leaf_count = 0;
};

}  // namespace mray::cpu
