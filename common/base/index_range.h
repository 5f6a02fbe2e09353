// Ranges of indices.
#pragma once

#include <cstdint>

namespace mray {

/// Indices [begin, end).
struct IndexRange {
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    bool operator==(const IndexRange&) const = default;
};

/// A list of one range with all indices.
inline constexpr IndexRange kAllIndices[1] = {{0, 0xFFFFFFFFu}};

}  // namespace mray
