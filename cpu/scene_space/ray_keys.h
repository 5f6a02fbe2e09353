// Places of a caller's rays on a curve through origins and directions.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/scene/scene_space.h"
#include "common/simd/simd_target.h"

namespace mray::cpu {

/// A Morton curve (G. M. Morton. A Computer Oriented Geodetic Data Base. IBM, 1966) through the
/// coordinates of rays: x, y and z of the origin, then both of the direction on an octahedron, from
/// -1 to 1 (Q. Meyer et al. On Floating-Point Normal Vectors. EGSR, 2010).
struct RayCurve {
    static constexpr int kCoordinates = 5;
    static constexpr int kKeyBits = 16;
    static constexpr int kMostCells = 256;

    /// The number of a cell along coordinate k is (coordinate - lower[k]) * scale[k], cut at 0 and
    /// at last[k], which is less than kMostCells.
    std::array<float, kCoordinates> lower{};
    std::array<float, kCoordinates> scale{};
    std::array<std::int32_t, kCoordinates> last{};
    /// The bits of a key that a cell's number gives: keys are the disjunctions of all five.
    std::array<std::array<std::uint32_t, kMostCells>, kCoordinates> bits{};
};

/// The coordinates of one ray; of directions that are 0 or not finite some number, or NaN.
std::array<float, RayCurve::kCoordinates> ray_coordinates(const StoredRay& ray);

/// Sets keys[i] to that of rays[i]; as many of both. Keys may differ with the target for rays at
/// the ends of cells. Rays with numbers that are not finite have some key.
void find_ray_keys(const RayCurve& curve, const SimdTarget& target, std::span<const StoredRay> rays,
                   std::span<std::uint16_t> keys);

}  // namespace mray::cpu
