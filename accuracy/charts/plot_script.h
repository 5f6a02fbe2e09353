// Scripts of gnuplot that read a CSV file beside them and write an SVG and a PNG file.
#pragma once

#include <string>

namespace mray::accuracy {

/// The parts of a script. `title` and `footer` are one line each; `body` is gnuplot and follows
/// them.
struct PlotScript {
    std::string title;
    std::string footer;
    int width = 1100;
    int height = 700;
    /// The layout of `set multiplot` for an image of several plots, such as "1,2" for two side by
    /// side; empty for one plot.
    std::string layout;
    std::string body;
};

/// The whole script, which reads NAME.csv and writes NAME.svg and NAME.png.
std::string script_text(const PlotScript& script, const std::string& name);

}  // namespace mray::accuracy
