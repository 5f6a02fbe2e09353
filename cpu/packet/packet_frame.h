// The common part of camera packets and light packets, as plain data: rays with one origin in
// blocks of 4 x 4, and the plane that they are seen in.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

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

}  // namespace mray::cpu
