// Albedo of the built-in scenes: linear, bright enough to be told apart in the shade.
#pragma once

#include <array>
#include <cstdint>

#include "common/scene/mesh.h"

namespace mray {

constexpr Albedo rgb(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
    return r | (g << 8) | (b << 16);
}

/// Distinct colours for parts, repeating.
constexpr Albedo palette(std::uint64_t i) {
    constexpr std::array<Albedo, 8> colours = {
        rgb(176, 42, 30),  rgb(28, 98, 150),  rgb(208, 140, 26), rgb(40, 120, 60),
        rgb(120, 60, 140), rgb(24, 136, 130), rgb(206, 92, 40),  rgb(170, 160, 130)};
    return colours[i % colours.size()];
}

}  // namespace mray
