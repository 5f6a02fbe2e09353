// Figures for tests: long legends, names at one place, long names of bars and cells.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tools/plot/bars.h"
#include "tools/plot/figure.h"

namespace mray::test {

/// Curves with titles of up to 40 characters, over a range that `largest` ends.
inline plot::Panel curve_panel(double largest, std::size_t curves) {
    plot::Panel panel{.title = "curves", .x = {.title = "x"}, .y = {.title = "y"}};
    for (std::size_t i = 0; i < curves; ++i) {
        panel.curves.push_back({"a curve with a long title, number " + std::to_string(i),
                                {{1, 1}, {largest / 2, 3}, {largest, 2 + static_cast<double>(i)}},
                                plot::style_of(i)});
    }
    return panel;
}

inline plot::Panel bar_panel() {
    plot::Panel panel{.title = "bars", .x = {.title = "length"}};
    panel.colour_names = {{"first", plot::kPalette[0]},
                          {"the second colour, which has a long name", plot::kPalette[1]}};
    for (const char* name : {"one", "a much longer name", "three"})
        plot::add_bars(panel, name, {{3, plot::kPalette[0]}, {7, plot::kPalette[1]}},
                       "a note on the bars");
    return panel;
}

/// Names of 15 points that are nearly one.
inline plot::Panel named_panel() {
    plot::Panel panel{.title = "names",
                      .x = {.scale = plot::Scale::kLog10, .zero_name = "none"},
                      .y = {.title = "y"}};
    plot::Curve curve{"points", {}, {.line = false}};
    for (int i = 0; i < 15; ++i) {
        const plot::Point at{i < 12 ? 0.0 : 1000.0 * i, 20 + 0.1 * i};
        curve.points.push_back(at);
        panel.point_names.push_back({at, "method number " + std::to_string(i), plot::kTextColour});
    }
    panel.curves.push_back(std::move(curve));
    return panel;
}

inline plot::Figure all_panels() {
    return {.title = "It's a figure",
            .footer = std::string(40, 'w') + " " + std::string(400, 'x') + " end",
            .columns = 2,
            .panel_width = 420,
            .panel_height = 260,
            .panels = {curve_panel(10, 3), curve_panel(4096, 9), bar_panel(), named_panel()}};
}

}  // namespace mray::test
