// Where the parts of a figure stand, in pixels; y points down.
#pragma once

#include <string_view>
#include <vector>

#include "tools/plot/axis_range.h"
#include "tools/plot/label_placement.h"

namespace mray::plot {

/// Pixels of all text but the figure's title, of that title, and from line to line.
inline constexpr double kFontSize = 14;
inline constexpr double kTitleFontSize = 16;
inline constexpr double kLineHeight = 18;
/// The width of the line before a text of a legend.
inline constexpr double kLegendSample = 34;

/// A width that is enough for the text in any of the fonts that may draw it.
double text_width(std::string_view text, double font_size);

/// An entry of a legend: a text with a sample of a curve or a colour of rectangles before it.
struct LegendEntry {
    std::string text = {};
    /// Whether the sample is one of a curve; if not, `style.colour` is that of rectangles.
    bool is_curve = true;
    Style style = {};
    /// From the left end of the sample to the end of the text.
    Box box = {};
    /// Where the text begins.
    double text_left = 0;
};

struct PanelLayout {
    AxisRange x;
    AxisRange y;
    /// Between the axes.
    Box area;
    std::vector<LegendEntry> legend;
    /// The height of a legend above the area.
    double legend_height = 0;
    /// A place for each of Panel::point_names.
    std::vector<PlacedName> names;
    /// The names of the x axis, broken to lines that fit, separated by \n.
    std::vector<std::string> x_names;
    /// The names of the y axis, likewise.
    std::vector<std::string> y_names;
    /// The title of the x axis, broken likewise.
    std::string x_title;

    /// Where a point stands.
    Point pixel(Point at) const {
        return {area.left + area.width * x.fraction(at.x),
                area.bottom() - area.height * y.fraction(at.y)};
    }
};

struct FigureLayout {
    int width = 0;
    int height = 0;
    /// The footer, broken to lines that fit.
    std::string footer;
    /// For each of Figure::panels.
    std::vector<PanelLayout> panels;
};

FigureLayout lay_out(const Figure& figure);

/// The figure for a page of this width in pixels: its panels are less wide than they were if need
/// be, and below each other with their legends above them where two have no room. Title and footer
/// are left out, which the page has, and there notes on rows, too, and points are named by numbers,
/// for which the page has Figure::key. Panels have a least width, for
/// which names of rows are broken to lines; a map, and a figure with a long word in a name, may be
/// wider.
Figure fitted(const Figure& figure, int width);

}  // namespace mray::plot
