// Figures of several panels, drawn by matplotlib from a CSV file with the script plot.py.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mray::plot {

/// One panel: the texts that plot.py names. All panels of a figure have the same "kind".
using Panel = std::map<std::string, std::string>;

struct Figure {
    std::string title = {};
    /// Not drawn; in the file's metadata.
    std::string details = {};
    std::vector<Panel> panels = {};
};

/// Throws Error(kUnavailable) without a python3 that has matplotlib, or without the script.
void require_matplotlib();

/// Draws a figure of columns of this CSV as "svg", "pdf" or "png"; `narrow` for phones and columns
/// of a paper. Throws Error: kInternal if matplotlib fails, kUnavailable without the script,
/// kOutput without a temporary file.
std::string draw(const Figure& figure, std::string_view csv, std::string_view format,
                 bool narrow = false);

}  // namespace mray::plot
