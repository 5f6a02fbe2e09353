#include "accuracy/charts/plot_script.h"

#include <fmt/format.h>

#include "common/process/gnuplot.h"

namespace mray::accuracy {

std::string script_text(const PlotScript& script, const std::string& name) {
    std::string text = fmt::format(
        "# gnuplot {0}.gp: {0}.csv to {0}.svg and {0}.png\n"
        "set datafile separator ','\n"
        "set encoding utf8\n"
        "set grid lt 1 lw 1 lc rgb '#e4e4e4'\n"
        "do for [ending in 'svg png'] {{\n"
        "if (ending eq 'svg') {{\n"
        "set terminal svg size {1},{2} font 'Helvetica,13' background '#ffffff'\n"
        "}} else {{\n"
        "set terminal pngcairo size {1},{2} font 'Helvetica,11' background '#ffffff'\n"
        "}}\n"
        "set output '{0}.'.ending\n",
        name, script.width, script.height);
    if (script.layout.empty()) {
        text += fmt::format("set title {} noenhanced font ',15'\nset bmargin 6\n",
                            gnuplot_quoted(script.title));
    } else {
        text += fmt::format(
            "set multiplot layout {} title {} noenhanced font ',15' margins 0.07,0.97,0.14,0.88 "
            "spacing 0.08\n",
            script.layout, gnuplot_quoted(script.title));
    }
    text += fmt::format(
        "set label 1 {} at screen 0.01,0.02 left noenhanced font ',10' tc rgb '#555555'\n",
        gnuplot_quoted(script.footer));
    text += script.body;
    if (!script.layout.empty()) text += "unset multiplot\n";
    return text + "unset output\n}\n";
}

}  // namespace mray::accuracy
