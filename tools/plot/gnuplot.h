// gnuplot, which draws figures.
#pragma once

#include <string>

#include "tools/plot/figure.h"

namespace mray::plot {

/// Whether the command is installed.
bool has_gnuplot();

/// Runs a script in a folder ("": the current one); returns what it writes to stdout. Throws
/// Error(kInternal) with gnuplot's message if it fails.
std::string run_gnuplot(const std::string& folder, const std::string& script);

/// The figure as SVG. Throws as run_gnuplot.
std::string svg_of(const Figure& figure);

/// Draws the figure to a file whose name ends in .svg or .png, whole or not at all. Throws
/// Error(kOutput) and as run_gnuplot.
void draw(const Figure& figure, const std::string& file);

}  // namespace mray::plot
