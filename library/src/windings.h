// How often the meshes wind around points: a WindingQuery in scene space, and what it leaves
// uncertain exactly, in world space.
#pragma once

#include "library/src/query_parts.h"

namespace morphray::detail {

/// The crossings of a half-line from a point.
struct PointWinding {
    std::int32_t winding = 0;
    std::uint32_t crossings = 0;
    bool is_on_surface = false;

    bool is_inside(FillRule rule) const {
        if (is_on_surface) return true;
        return rule == FillRule::nonzero ? winding != 0 : (crossings & 1) != 0;
    }
};

/// Calls visit(number, winding) for all points in many threads; those that are not finite have no
/// crossing.
void find_windings(const PointBlock& block,
                   const std::function<void(std::size_t number, const PointWinding&)>& visit);

}  // namespace morphray::detail
