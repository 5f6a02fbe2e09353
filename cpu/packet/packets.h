// Packets as plain data without SIMD types: rays with one origin in blocks of 4 x 4, and the plane
// that they are seen in; camera packets; light packets.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/bvh/node.h"
#include "common/interop/camera.h"
#include "common/interop/ray.h"

namespace mray::cpu {

inline constexpr std::uint32_t kBlockSide = 4;
inline constexpr std::uint32_t kBlockRays = kBlockSide * kBlockSide;

/// kWhereItPays: a packet is given up where rays one by one are expected to be faster. The bits of
/// answers do not depend on it.
enum class PacketUse : std::uint8_t { kAlways, kWhereItPays };

inline constexpr std::uint64_t kAllBlocks = ~std::uint64_t{0};

/// Stands for 1/z. kDone is nearer than any candidate: it marks rays that need no further test.
/// kAnyDepth is nearer than any hit but not than kDone: it marks boxes and triangles that reach to
/// the origin or behind it.
inline constexpr float kDone = std::numeric_limits<float>::infinity();
inline constexpr float kAnyDepth = 3e38f;

/// Bounds x and y of a rectangle that is the whole plane: far beyond any ray, since `reach` is 33.
inline constexpr float kWholePlane = 1e6f;

/// The lower bound of an empty range of x or y; the upper one is its negative.
inline constexpr float kEmptyLower = 1e30f;

/// Bounds of x and y in a packet's plane.
struct PlaneRectangle {
    float lower_x, upper_x, lower_y, upper_y;

    static constexpr PlaneRectangle whole() {
        return {-kWholePlane, kWholePlane, -kWholePlane, kWholePlane};
    }
    static constexpr PlaneRectangle none() {
        return {kEmptyLower, -kEmptyLower, kEmptyLower, -kEmptyLower};
    }

    void add(const PlaneRectangle& r) {
        lower_x = std::min(lower_x, r.lower_x);
        upper_x = std::max(upper_x, r.upper_x);
        lower_y = std::min(lower_y, r.lower_y);
        upper_y = std::max(upper_y, r.upper_y);
    }
};

/// Rectangles in arrays, which vectors load.
template <std::size_t kCount>
struct alignas(64) PlaneRectangles {
    float lower_x[kCount], upper_x[kCount], lower_y[kCount], upper_y[kCount];

    PlaneRectangle operator[](std::size_t i) const {
        return {lower_x[i], upper_x[i], lower_y[i], upper_y[i]};
    }
    void set(std::size_t i, const PlaneRectangle& r) {
        lower_x[i] = r.lower_x;
        upper_x[i] = r.upper_x;
        lower_y[i] = r.lower_y;
        upper_y[i] = r.upper_y;
    }
    PlaneRectangle around_four(std::size_t first) const {
        PlaneRectangle all = (*this)[first];
        for (std::size_t i = 1; i < 4; ++i) all.add((*this)[first + i]);
        return all;
    }
};

/// A load waits for an earlier store if the lower 12 bits of their addresses are equal. Packets
/// start on pages, so that the same arrays collide in every process.
inline constexpr std::size_t kPage = 4096;

/// Stands for an axis: the rays' largest direction components lie on several axes.
inline constexpr std::uint32_t kMixedAxes = 3;

/// A plane through a packet's origin and parallel to an axis of scene space: all rays have
/// normal[0] d[axes[0]] + normal[1] d[axes[1]] >= 0 but for the rounding of `normal`, whose
/// magnitudes add up to 1.
struct WedgeSide {
    std::uint32_t axes[2];
    float normal[2];
};

/// A packet's projection. A point p relative to the origin has (x, y, z) = rows * p and is seen at
/// (x / z, y / z). Every ray has z > 0.
struct PacketFrame {
    vec3 org;
    /// No ray is farther than this from the plane's origin on either axis.
    float reach;
    double rows[3][3];
    float rows_f[3][3];
    /// Sums of the magnitudes of a row.
    float row_size[3];
    /// How far a ray's stored x or y may be from that of its exact direction. A camera packet
    /// stores the middles of pixels.
    float ray_error;
    float lower_x, upper_x, lower_y, upper_y;
    /// The depth margin, and how far from the exact hit the rule may place one, in z.
    float depth_margin, depth_error;
    /// The axis on which all rays have their largest direction component, with this sign (1 or -1);
    /// or kMixedAxes, without a sign.
    std::uint32_t axis;
    float axis_sign;
    /// Bounds of the magnitude of a ray's largest direction component at z = 1; 1 / depth_least.
    float depth_least, depth_most, per_depth;
    /// Two planes for each axis, or fewer.
    std::uint32_t wedge_side_count;
    WedgeSide wedge_sides[6];
};

// ---- Limits of the bounds of TriangleSetup (docs/design/arithmetic.md, "Packets")

/// A triangle is in front of the origin if all z of its vertices are more than kFrontDepth times
/// the largest |z|, plus kFrontError times the error of a vertex (lab/proofs/packet_rectangles.g),
/// and above kLeastFrontZ, so that 1/z and its products stay finite.
inline constexpr float kFrontDepth = 0x1p-10f;
inline constexpr float kFrontError = 16.0f;
inline constexpr float kLeastFrontZ = 1e-10f;

/// Edge functions are at most bound / kEdgeRounding. A triangle with a larger bound may overflow:
/// nothing is known of it, and it has kUnknown, larger than any other, for bound or error of 1/z.
inline constexpr float kMostBound = 1e28f;
inline constexpr float kUnknown = 1e35f;

/// Multiply an error of 1/z to cover its own rounding, a few products and sums.
inline constexpr float kCameraErrorFactor = 1.0001f;
inline constexpr float kLightErrorFactor = 1 + 0x1p-18f;

/// Pixels [x0, x1) x [y0, y1).
struct Tile {
    std::uint32_t x0, y0, x1, y1;
};

/// An image in tiles of side x side pixels, row by row; the last of a row or column may be
/// smaller.
class ImageTiles {
public:
    ImageTiles(std::uint32_t width, std::uint32_t height, std::uint32_t side)
        : width_(width), height_(height), side_(side), columns_((width + side - 1) / side) {}

    std::uint32_t count() const { return columns_ * ((height_ + side_ - 1) / side_); }
    Tile operator[](std::uint32_t i) const {
        const std::uint32_t x = i % columns_ * side_;
        const std::uint32_t y = i / columns_ * side_;
        return {x, y, std::min(x + side_, width_), std::min(y + side_, height_)};
    }

private:
    std::uint32_t width_, height_, side_, columns_;
};

// ---- Camera packets: up to 64 x 64 camera rays on a grid of pixels, and the closest candidate of
// each

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

// ---- Light packets: up to 64 x 64 rays that start at one point, such as shadow rays from a light,
// and which of them are occluded.
//
//             rays      consists of    serves
//   block     4 x 4                    tests of a triangle against a block's rays
//   quad      8 x 8     2 x 2 blocks   the boxes of nodes: the active rays are a set of quads
//   group     16 x 16   2 x 2 quads    leaves: bounds of sixteen blocks, as many as vectors have
//   lanes square    32 x 32   2 x 2 groups   tiles of fewer rays, which have one or two squares
//   packet    64 x 64   2 x 2 squares

/// Blocks are stored in Morton order. As many blocks again may hold regrouped rays.
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

/// The parts of a ray's index that come from x and from y: blocks in Morton order, the rays of a
/// block column by column.
struct LightRayIndices {
    std::uint16_t x[kLightPacketSide]{}, y[kLightPacketSide]{};

    constexpr LightRayIndices() {
        for (std::uint32_t i = 0; i < kLightPacketSide; ++i) {
            std::uint32_t blocks = 0;
            for (std::uint32_t bit = 0; kBlockSide << bit < kLightPacketSide; ++bit)
                blocks |= (i / kBlockSide >> bit & 1) << 2 * bit;
            x[i] = static_cast<std::uint16_t>(blocks * kBlockRays + i % kBlockSide * kBlockSide);
            y[i] = static_cast<std::uint16_t>(2 * blocks * kBlockRays + i % kBlockSide);
        }
    }
};
inline constexpr LightRayIndices kLightRayIndices;

inline std::uint32_t light_packet_ray(std::uint32_t x, std::uint32_t y) {
    return std::uint32_t{kLightRayIndices.x[x]} + kLightRayIndices.y[y];
}

/// Returns how many squares the rays of width x height pixels need.
inline std::uint32_t light_packet_squares(std::uint32_t width, std::uint32_t height) {
    return (height > kSquareSide ? 2 : 0) + (width > kSquareSide ? 2 : 1);
}

/// The rays of a block, which start at one point: dir[axis][i] and tfar[i] belong to ray i, as
/// in Ray; tnear is 0. Ray i is absent where tfar[i] < 0.
struct alignas(64) SharedOriginRays {
    float dir[3][kBlockRays], tfar[kBlockRays];

    static SharedOriginRays none() {
        SharedOriginRays rays{};
        std::fill_n(rays.tfar, kBlockRays, -1.0f);
        return rays;
    }

    bool has(std::size_t i) const { return tfar[i] >= 0; }
    /// How many rays there are. Compilers make vectors of bits, but not of has().
    std::size_t count() const {
        std::uint32_t found = 0;
        for (const float end : tfar) {
            const auto bits = std::bit_cast<std::uint32_t>(end);
            found += (bits <= 0x7F800000u ? 1u : 0u) | (bits == 0x80000000u ? 1u : 0u);
        }
        return found;
    }
    vec3 direction(std::size_t i) const { return {dir[0][i], dir[1][i], dir[2][i]}; }
    Ray ray(vec3 org, std::size_t i) const { return {org, 0, direction(i), tfar[i]}; }

    void set(std::size_t i, const Ray& ray) {
        for (int axis = 0; axis < 3; ++axis) dir[axis][i] = ray.dir[axis];
        tfar[i] = ray.tfar;
    }
};

/// Writes the indices of the rays that there are, in ascending order, to `indices`, which has room
/// for all. Returns their number.
inline std::size_t list_rays(std::span<const SharedOriginRays> blocks, std::uint16_t* indices) {
    std::size_t count = 0;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        if (blocks[b].count() == 0) continue;
        for (std::size_t i = 0; i < kBlockRays; ++i) {
            if (blocks[b].has(i)) indices[count++] = static_cast<std::uint16_t>(b * kBlockRays + i);
        }
    }
    return count;
}

/// Stands for the index of a ray: there is none.
inline constexpr std::uint16_t kNoRay = 0xFFFF;

struct alignas(kPage) LightPacket {
    PacketFrame frame;
    /// The caller's rays, a block each.
    const SharedOriginRays* rays;
    /// By ray, the rays of the regrouped blocks behind the others. x and y are the ray's place in
    /// the plane. A hit with 1/z less than q_lower does not concern the ray; kDone: it is occluded
    /// or absent.
    alignas(64) float x[kAllLightPacketRays];
    float y[kAllLightPacketRays], q_lower[kAllLightPacketRays];
    /// The least q_lower of each block.
    float block_q[kAllLightPacketBlocks];
    /// The bounds of the active rays of each block; empty (lower > upper) without any.
    PlaneRectangles<kAllLightPacketBlocks> blocks;
    /// Bounds of the active rays of each quad, and the least q_lower in it.
    PlaneRectangles<kLightPacketQuads> quads;
    float quad_q[kLightPacketQuads];
    PlaneRectangles<kLightPacketGroups> groups;
    std::uint32_t square_count;
    /// The number of regrouped blocks, which are kLightPacketBlocks and those after it.
    std::uint32_t regrouped_count;
    /// The rays of the regrouped blocks, and the caller's index of each, or kNoRay.
    SharedOriginRays regrouped[kLightPacketBlocks];
    std::uint16_t regrouped_ray[kLightPacketRays];
};

}  // namespace mray::cpu
