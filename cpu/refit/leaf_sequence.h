// Which leaves a refit visits.
#pragma once

#include <cstdint>

namespace morphray::cpu {

/// Leaves list[0 .. count), or 0 .. count themselves if there is no list.
struct LeafSequence {
    const std::uint32_t* list;
    std::uint32_t count;

    std::uint32_t operator[](std::uint32_t i) const { return list == nullptr ? i : list[i]; }
};

}  // namespace morphray::cpu
