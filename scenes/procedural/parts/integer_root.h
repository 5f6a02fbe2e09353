// Cube roots of counts. std::cbrt rounds differently in different libms.
#pragma once

#include <cstdint>

namespace mray {

/// The largest n with n^3 <= x, for x up to 2^60.
constexpr std::uint32_t cube_root(std::uint64_t x) {
    std::uint64_t root = 0;
    for (std::uint64_t bit = std::uint64_t{1} << 20; bit > 0; bit >>= 1) {
        const std::uint64_t next = root | bit;
        if (next * next * next <= x) root = next;
    }
    return static_cast<std::uint32_t>(root);
}

}  // namespace mray
