// Counts of the test of cpu/queries/triangle_sides-inl.h, for code that is compiled once per
// target.
#pragma once

#include <cstddef>

namespace mray::test {

struct SideCounts {
    /// Bounds above the rule's distance, and below most of it.
    std::size_t above = 0;
    std::size_t below = 0;
    /// Points that are closest to a vertex, and to an edge or the inside.
    std::size_t vertices = 0;
    std::size_t others = 0;
};

}  // namespace mray::test
