#include "app/view/legend.h"

#include <fmt/format.h>

#include <cmath>

#include "common/image/heat_colours.h"
#include "common/interop/lit.h"

namespace mray::app {
namespace {

using morphray::Shading;

constexpr int kLegendColours = 96;

/// A bar whose colour at x, from 0 to 1, is colour(x).
template <class Colour>
Legend bar_of(std::string title, const Colour& colour) {
    Legend legend{.title = std::move(title), .colours = {}, .ticks = {}};
    for (int i = 0; i < kLegendColours; ++i)
        legend.colours.push_back(colour(static_cast<float>(i) / (kLegendColours - 1)));
    return legend;
}

}  // namespace

Legend legend_of(Shading shading, const DepthRange& depths) {
    if (shading == Shading::steps) {
        Legend legend = bar_of("nodes and leaves that a ray enters", [](float x) {
            return steps_colour(static_cast<std::uint32_t>(std::lround(std::exp2(8 * x))));
        });
        for (const int n : {0, 2, 4, 6, 8})
            legend.ticks.push_back({static_cast<float>(n) / 8, std::to_string(1 << n)});
        return legend;
    }
    if (shading == Shading::sah) {
        Legend legend = bar_of("area of the leaf's box over that of its triangles",
                               [](float x) { return looseness_colour(std::exp2(6 * x)); });
        for (const int n : {0, 2, 4, 6})
            legend.ticks.push_back({static_cast<float>(n) / 6, std::to_string(1 << n)});
        return legend;
    }
    if (shading == Shading::depth) {
        Legend legend =
            bar_of("depth along the view", [](float x) { return depth_colour(x, 0, 1); });
        for (const float place : {0.0f, 0.5f, 1.0f}) {
            legend.ticks.push_back(
                {place, fmt::format("{:.4g}", depths.near + double{place} * depths.range)});
        }
        return legend;
    }
    return {};
}

}  // namespace mray::app
