// Points in an order in which neighbours are near each other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/platform.h"

namespace morphray::detail {

/// Which points are neighbours.
enum class PointOrder {
    places,   // those near each other
    columns,  // those above each other, along z
};

/// A permutation of the points: along a Morton curve over their bounds (G. M. Morton. A Computer
/// Oriented Geodetic Data Base. IBM, 1966). Points with a component that is not finite come
/// somewhere. At most 2^32 points.
std::vector<std::uint32_t> order_points(std::span<const mray::vec3> points, PointOrder by);

}  // namespace morphray::detail
