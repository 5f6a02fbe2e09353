// A figure of several panels as plain data. `morphray chart` and `profile --plot` make them;
// gnuplot_script.h draws them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/plot/palette.h"

namespace mray::plot {

struct Point {
    double x = 0;
    double y = 0;
};

/// kAuto is kLog10 if all values are positive and the largest is more than kLogRatio times the
/// least, else kLinear.
enum class Scale { kAuto, kLinear, kLog10, kLog2 };
inline constexpr double kLogRatio = 30;

struct Axis {
    std::string title = {};
    Scale scale = Scale::kAuto;
    /// A linear axis begins at the least value instead of at 0.
    bool tight = false;
    /// Not empty: names of the places 0, 1, 2 ..., from left to right or from top to bottom; such
    /// an axis has no numbers.
    std::vector<std::string> names = {};
    /// Not empty: values of 0 or less stand below the others of a logarithmic axis, at a place of
    /// this name.
    std::string zero_name = {};
    /// Above 0: the least positive value that there can be, which a logarithmic axis shows, too.
    double least_positive = 0;
};

/// The least and the largest value of a point that stands for several.
struct Range {
    double least = 0;
    double most = 0;
};

/// Points with a line, symbols or both. A curve without points is not in the legend.
struct Curve {
    /// Its text in the legend; empty: none.
    std::string title;
    std::vector<Point> points;
    Style style;
    /// A vertical bar through each point; empty: none, else one for each point.
    std::vector<Range> ranges = {};
};

/// A filled rectangle between two corners.
struct Rectangle {
    Point first;
    Point second;
    std::uint32_t colour = 0;
};

/// The name of a point; it stands where it overlaps no other, with a line to its point if need be.
struct PointName {
    Point at;
    std::string text;
    std::uint32_t colour = kTextColour;
};

/// Text with its centre at a place, shifted down by a number of lines.
struct CentredText {
    Point at;
    std::string text;
    std::uint32_t colour = kTextColour;
    double lines_down = 0;
};

/// Text at the height y, to the right of the panel.
struct RowNote {
    double y = 0;
    std::string text;
};

/// The name of a colour of rectangles, in the legend.
struct ColourName {
    std::string text;
    std::uint32_t colour = 0;
};

/// Where a legend stands, always outside the axes.
enum class Legend { kNone, kRight, kAbove };

struct Panel {
    std::string title = {};
    Axis x = {};
    Axis y = {};
    std::vector<Curve> curves = {};
    std::vector<Rectangle> rectangles = {};
    std::vector<ColourName> colour_names = {};
    std::vector<PointName> point_names = {};
    std::vector<CentredText> texts = {};
    std::vector<RowNote> row_notes = {};
    Legend legend = Legend::kRight;
};

struct Figure {
    /// One line each.
    std::string title = {};
    std::string footer = {};
    /// Panels side by side.
    std::size_t columns = 1;
    /// Pixels between the axes of a panel.
    int panel_width = 760;
    int panel_height = 480;
    /// Names of rows are broken at spaces to lines of at most so many pixels.
    double row_name_width = 1000;
    std::vector<Panel> panels = {};
    /// The names of points that are named 1, 2, 3 ... instead; not drawn.
    std::vector<std::string> key = {};
};

}  // namespace mray::plot
