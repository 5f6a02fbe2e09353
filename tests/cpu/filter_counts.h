// What a filter of triangles did over many pairs of triangle and ray.
#pragma once

#include <cstddef>

namespace morphray::cpu {

struct FilterCounts {
    std::size_t hits = 0;
    std::size_t lost_hits = 0;
    /// Kept although may_hit_triangle excludes them, or in unused slots.
    std::size_t kept_misses = 0;
    std::size_t left_out = 0;
};

}  // namespace morphray::cpu
