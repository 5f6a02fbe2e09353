// Figures of several panels, drawn by gnuplot from a CSV file with the script plot.gp.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mray::plot {

/// One panel; plot.gp says what its members mean. Empty ones are left out.
struct Panel {
    /// lines, points or map.
    std::string kind;
    std::string title = {};
    /// Names of columns of the CSV.
    std::string x = {};
    std::string y = {};
    std::string series = {};
    std::string xlabel = {};
    std::string ylabel = {};
    std::string where = {};
    std::string is = {};
    std::string ring = {};
    std::string least = {};
    std::string logx = {};
    std::string across = {};
    std::string shade = {};
    std::string note = {};
};

struct Figure {
    /// One line each.
    std::string title = {};
    std::string footer = {};
    /// Panels side by side, and the pixels of the height of one.
    int columns = 1;
    int panel_height = 480;
    std::vector<Panel> panels = {};
};

/// Throws Error(kUnavailable) without gnuplot or its script; `who` begins the message of the
/// former.
void require_gnuplot(std::string_view who);

/// The image, as "svg" or "png", of a figure that shows columns of this CSV. Throws Error:
/// kInternal if gnuplot fails, kUnavailable without the script, kOutput without a temporary file.
std::string draw(const Figure& figure, std::string_view csv, std::string_view format);

}  // namespace mray::plot
