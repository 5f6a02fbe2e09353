// gnuplot, which draws charts.
#pragma once

#include <string>
#include <string_view>

namespace mray {

/// Whether the command is installed.
bool has_gnuplot();

/// Text in gnuplot's single quotes, where nothing is expanded; line ends are left out.
std::string gnuplot_quoted(std::string_view text);

}  // namespace mray
