// Horizontal bars with names.
#pragma once

#include <string>
#include <vector>

#include "tools/plot/figure.h"

namespace mray::plot {

struct Bar {
    double length = 0;
    std::uint32_t colour = kPalette[0];
};

/// Adds a row of bars below those that the panel has, with its name on the left and a note on the
/// right.
void add_bars(Panel& panel, const std::string& name, const std::vector<Bar>& bars,
              const std::string& note);

}  // namespace mray::plot
