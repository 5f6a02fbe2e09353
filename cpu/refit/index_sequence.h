// Which leaves or nodes a refit visits.
#pragma once

#include <cstdint>

namespace mray::cpu {

/// list[0 .. count), or first .. first + count - 1 if there is no list.
struct IndexSequence {
    const std::uint32_t* list;
    std::uint32_t first;
    std::uint32_t count;

    std::uint32_t operator[](std::uint32_t i) const {
        return list == nullptr ? first + i : list[i];
    }
};

}  // namespace mray::cpu
