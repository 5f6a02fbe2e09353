// The HTML page of all charts.
#pragma once

#include <string>
#include <vector>

#include "accuracy/charts/charts.h"

namespace mray::accuracy {

/// A chart with its image as SVG for wide pages and for phones, and the names of the points that
/// have numbers on phones. All are empty without an image.
struct PagedChart {
    const Chart* chart;
    std::string svg;
    std::string phone_svg;
    std::vector<std::string> phone_key;
};

/// Draws the image of a chart, if it has one. Throws as plot::svg_of.
PagedChart page_chart(const Chart& chart);

/// HTML that needs no other file and no network. Its text and that of its images have one size on
/// phones and desktops; it is dark where the browser prefers that, and prints in black on white.
std::string chart_page(const std::vector<PagedChart>& charts, const std::string& machine,
                       const std::string& command);

}  // namespace mray::accuracy
