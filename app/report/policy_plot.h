// A comparison of policies as a figure, drawn by gnuplot.
#pragma once

#include <string>

#include "app/report/policy_report.h"

namespace mray::app {

/// Throws Error: kBadArgument for a file that ends neither in .svg nor in .png, kUnavailable
/// without gnuplot.
void require_plotter(const std::string& file);

/// Draws the panels of plot::policy_panels for each backend; for a built-in scene also the time of
/// refit and transfer by triangles. Throws as require_plotter, and Error(kOutput).
void plot_policies(const PolicyReport& report, const std::string& file);

}  // namespace mray::app
