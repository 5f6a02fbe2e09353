// The HTML page of all charts.
#pragma once

#include <string>
#include <vector>

#include "lab/accuracy/charts/charts.h"

namespace mray::accuracy {

/// A chart with its image as SVG, which is empty if there is none.
struct PagedChart {
    const Chart* chart;
    std::string svg;
};

/// HTML that needs no other file and no network and is dark where the browser prefers that, and
/// prints in black on white.
std::string chart_page(const std::vector<PagedChart>& charts, const std::string& machine,
                       const std::string& command);

}  // namespace mray::accuracy
