// Colours and symbols of curves, which people with any colour vision tell apart.
// Based on: M. Okabe, K. Ito. Color Universal Design. 2008; P. Tol. Colour Schemes. 2021. Their
// yellow, which is faint on white, is left out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mray::plot {

inline constexpr std::uint32_t kTextColour = 0x333333;
inline constexpr std::uint32_t kPaleTextColour = 0x666666;
inline constexpr std::uint32_t kGridColour = 0xE4E4E4;
inline constexpr std::uint32_t kGuideColour = 0x888888;

inline constexpr std::array<std::uint32_t, 9> kPalette = {
    0x0072B2, 0xD55E00, 0x009E73, 0xCC79A7, 0xE69F00, 0x56B4E9, 0x000000, 0x7F7F7F, 0x882255};
/// gnuplot's numbers of symbols: filled ones, then outlines.
inline constexpr std::array<int, 9> kSymbols = {7, 5, 9, 13, 11, 6, 4, 8, 12};
inline constexpr int kRing = 6;

/// How a curve is drawn.
struct Style {
    std::uint32_t colour = kPalette[0];
    int symbol = kSymbols[0];
    double symbol_size = 0.8;
    bool line = true;
    bool symbols = true;
    bool dashed = false;
    double line_width = 2;
};

/// The style of the curve `index`; curves beyond the palette repeat its colours, dashed.
constexpr Style style_of(std::size_t index) {
    return {.colour = kPalette[index % kPalette.size()],
            .symbol = kSymbols[index % kSymbols.size()],
            .dashed = index / kPalette.size() % 2 == 1};
}

}  // namespace mray::plot
