// Scripts for gnuplot that read a CSV beside them and write an SVG and a PNG.
#pragma once

#include <string>

namespace morphray::accuracy {

/// What an image is made by: `body` is gnuplot, once `title` and `footer` (one line each) are set.
struct PlotScript {
    std::string title;
    std::string footer;
    int width = 1100;
    int height = 700;
    /// Of an image with several plots: `set multiplot` is told "1,2" for two side by side; empty
    /// for one.
    std::string layout;
    std::string body;
};

/// The whole script, which reads and writes files called `name` with an ending.
std::string script_text(const PlotScript& script, const std::string& name);

}  // namespace morphray::accuracy
