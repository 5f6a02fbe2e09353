// Figures of several panels, drawn by gnuplot from a CSV file with the script plot.gp.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mray::plot {

/// One panel: the variables of plot.gp, without those that are empty.
using Panel = std::map<std::string, std::string>;

struct Figure {
    std::string title = {};
    std::string footer = {};
    /// Pixels.
    int width = 640;
    int panel_height = 200;
    std::vector<Panel> panels = {};
};

/// Throws Error(kUnavailable) without gnuplot or its script; `who` begins the message.
void require_gnuplot(std::string_view who);

/// Draws a figure of columns of this CSV as "svg", "pdf" or "png". Throws Error:
/// kInternal if gnuplot fails, kUnavailable without the script, kOutput without a temporary file.
std::string draw(const Figure& figure, std::string_view csv, std::string_view format);

}  // namespace mray::plot
