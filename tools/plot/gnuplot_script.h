// Figures as scripts of gnuplot, with their data.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/plot/figure.h"

namespace mray::plot {

enum class Image { kSvg, kPng };

struct Output {
    Image image = Image::kSvg;
    /// Empty: stdout.
    std::string file;
};

/// A script that draws the figure to each output and reads no other file.
std::string script_of(const Figure& figure, const std::vector<Output>& outputs);

/// Text in gnuplot's single quotes, where nothing is expanded; line ends are left out, and bytes
/// that are not UTF-8 become \xNN.
std::string single_quoted(std::string_view text);
/// Text in gnuplot's double quotes, with its line ends.
std::string double_quoted(std::string_view text);

}  // namespace mray::plot
