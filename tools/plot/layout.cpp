#include "tools/plot/layout.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace mray::plot {
namespace {

constexpr double kEdge = 16;
constexpr double kTitleHeight = 48;
constexpr double kFooterGap = 14;
constexpr double kPanelTitleHeight = 26;
constexpr double kPanelGap = 22;
constexpr double kTickGap = 10;
constexpr double kLeastTickGap = 4;
/// The distance of a sample from its text, and the height of an entry of a legend.
constexpr double kLegendGap = 8;
constexpr double kLegendLine = 20;
/// Wider than any common sans serif font's mean.
constexpr double kCharacterWidth = 0.55;

/// The least width of panels side by side, and of a panel alone.
constexpr int kLeastColumnWidth = 360;
constexpr int kLeastWidth = 200;
/// The least width of a cell of a map, whose numbers have up to six digits.
constexpr int kLeastCellWidth = 52;
/// The least width of lines that names of rows are broken to.
constexpr double kLeastNameWidth = 60;

/// The margins of a panel around its area.
struct Margins {
    double left = 0;
    double right = 0;
    double top = 0;
    double bottom = 0;
};

std::size_t line_count(const std::string& text) {
    return 1 + static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

/// The width of the widest line.
double widest_line(const std::string& text) {
    double widest = 0;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        widest = std::max(widest,
                          text_width(std::string_view(text).substr(begin, end - begin), kFontSize));
        begin = end + 1;
    }
    return widest;
}

/// The width as it is shown: "10^{5}" takes three characters.
double tick_width(const std::string& text) {
    const bool power = text.starts_with("10^{");
    return text_width(power ? std::string_view(text).substr(3) : std::string_view(text), kFontSize);
}

bool ticks_meet(const AxisRange& x, double width) {
    for (std::size_t i = 1; i < x.ticks.size(); ++i) {
        const Tick& left = x.ticks[i - 1];
        const Tick& right = x.ticks[i];
        const double distance = width * (x.fraction(right.at) - x.fraction(left.at));
        const double texts = tick_width(left.text) + tick_width(right.text);
        if (distance < texts / 2 + kLeastTickGap) return true;
    }
    return false;
}

/// Leaves out ticks of an x axis whose texts would meet: first those between powers of ten.
void thin_out(AxisRange& x, double width) {
    if (x.log_base == 10 && ticks_meet(x, width)) {
        std::erase_if(x.ticks, [&](const Tick& tick) {
            const double power = std::log10(tick.at);
            return tick.at != x.zero_at && std::abs(power - std::round(power)) > 1e-9;
        });
    }
    while (x.ticks.size() > 2 && ticks_meet(x, width)) {
        std::vector<Tick> kept;
        for (std::size_t i = 0; i < x.ticks.size(); i += 2) kept.push_back(x.ticks[i]);
        x.ticks = std::move(kept);
    }
}

/// Breaks a text at spaces, and words without room after a hyphen, into lines of at most `width`
/// pixels.
std::string broken(const std::string& text, double width) {
    std::string result;
    std::string line;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(' ', begin), text.size());
        std::string word = text.substr(begin, end - begin);
        begin = end + 1;
        const std::size_t hyphen = word.find('-');
        if (text_width(word, kFontSize) > width && hyphen != word.npos)
            word.insert(hyphen + 1, 1, '\n');
        if (!line.empty() && text_width(line + " " + word, kFontSize) > width) {
            result += line + "\n";
            line = word;
        } else {
            line += (line.empty() ? "" : " ") + word;
        }
    }
    return result + line;
}

/// The entries of a legend, from the top left corner at 0, 0: below each other on the right; side
/// by side above the area, in as many rows as its width needs.
std::vector<LegendEntry> legend_of(const Panel& panel, double area_width) {
    std::vector<LegendEntry> entries;
    if (panel.legend == Legend::kNone) return entries;
    for (const ColourName& name : panel.colour_names)
        entries.push_back({.text = name.text, .is_curve = false, .style = {.colour = name.colour}});
    for (const Curve& curve : panel.curves) {
        if (!curve.points.empty() && !curve.title.empty())
            entries.push_back({.text = curve.title, .style = curve.style});
    }
    double left = 0;
    double top = 0;
    for (LegendEntry& entry : entries) {
        const double width = kLegendSample + kLegendGap + text_width(entry.text, kFontSize);
        const bool is_full = panel.legend == Legend::kRight || left + width > area_width;
        if (left > 0 && is_full) {
            left = 0;
            top += kLegendLine;
        }
        entry.box = {left, top, width, kLegendLine};
        entry.text_left = left + kLegendSample + kLegendGap;
        left += width + kPanelGap;
    }
    return entries;
}

/// Ranges of both axes and what depends on them alone.
PanelLayout fit_panel(const Panel& panel, double width, double row_name_width) {
    std::vector<double> x, y;
    const auto add = [&](const Point& point) {
        x.push_back(point.x);
        y.push_back(point.y);
    };
    for (const Curve& curve : panel.curves) {
        std::ranges::for_each(curve.points, add);
        for (const Range& range : curve.ranges) {
            y.push_back(range.least);
            y.push_back(range.most);
        }
    }
    for (const Rectangle& rectangle : panel.rectangles) {
        add(rectangle.first);
        add(rectangle.second);
    }
    PanelLayout layout;
    layout.x = fit_axis(panel.x, Direction::kX, x);
    layout.y = fit_axis(panel.y, Direction::kY, y);
    if (panel.x.names.empty()) thin_out(layout.x, width);
    const double room = width / static_cast<double>(std::max<std::size_t>(1, panel.x.names.size()));
    for (const std::string& name : panel.x.names) layout.x_names.push_back(broken(name, room));
    for (const std::string& name : panel.y.names)
        layout.y_names.push_back(broken(name, row_name_width));
    layout.x_title = broken(panel.x.title, width);
    layout.legend = legend_of(panel, width);
    if (panel.legend == Legend::kAbove && !layout.legend.empty())
        layout.legend_height = layout.legend.back().box.bottom();
    return layout;
}

double widest_entry(const PanelLayout& layout) {
    double widest = 0;
    for (const LegendEntry& entry : layout.legend) widest = std::max(widest, entry.box.width);
    return widest;
}

Margins margins_of(const Panel& panel, const PanelLayout& layout, double width) {
    Margins margins;
    for (const std::string& name : layout.y_names)
        margins.left = std::max(margins.left, widest_line(name));
    if (layout.y_names.empty()) {
        for (const Tick& tick : layout.y.ticks)
            margins.left = std::max(margins.left, tick_width(tick.text));
    }
    margins.left += kTickGap + (panel.y.title.empty() ? 0 : 2 * kLineHeight);
    margins.top = panel.title.empty() ? kTickGap : kPanelTitleHeight;
    std::size_t lines = 1;
    for (const std::string& name : layout.x_names) lines = std::max(lines, line_count(name));
    margins.bottom = kTickGap + static_cast<double>(lines) * kLineHeight +
                     (panel.x.title.empty()
                          ? 0
                          : (0.6 + static_cast<double>(line_count(layout.x_title))) * kLineHeight);
    margins.right = kPanelGap;
    for (const RowNote& note : panel.row_notes)
        margins.right = std::max(margins.right, kPanelGap + text_width(note.text, kFontSize));
    margins.top += layout.legend_height;
    const double widest = widest_entry(layout);
    if (panel.legend == Legend::kRight && widest > 0) {
        margins.right += kTickGap + widest;
    } else {
        // It may begin above the names of the y axis.
        margins.right = std::max(margins.right, widest - width - margins.left);
    }
    return margins;
}

/// Moves the legend to its place beside the area.
void place_legend(const Panel& panel, PanelLayout& layout) {
    const Box& area = layout.area;
    const bool right = panel.legend == Legend::kRight;
    const double left = area.left - std::clamp(widest_entry(layout) - area.width, 0.0,
                                               margins_of(panel, layout, area.width).left);
    for (LegendEntry& entry : layout.legend) {
        const double x = right ? area.right() + 2 * kTickGap : left;
        entry.box.left += x;
        entry.text_left += x;
        entry.box.top += right ? area.top : area.top - layout.legend_height - kTickGap / 2;
    }
}

void place_point_names(const Panel& panel, PanelLayout& layout) {
    std::vector<NameRequest> requests;
    for (const PointName& name : panel.point_names) {
        requests.push_back(
            {layout.pixel(name.at), text_width(name.text, kFontSize), kFontSize + 2});
    }
    layout.names = place_names(requests, layout.area);
}

/// Names points by numbers, the same name by the same number in all panels.
void number_points(Figure& figure) {
    for (Panel& panel : figure.panels) {
        for (PointName& name : panel.point_names) {
            const auto known = std::ranges::find(figure.key, name.text);
            const auto index = known - figure.key.begin();
            if (known == figure.key.end()) figure.key.push_back(name.text);
            name.text = std::to_string(index + 1);
        }
    }
}

}  // namespace

double text_width(std::string_view text, double font_size) {
    // Bytes that continue a character in UTF-8 take no place.
    const auto characters = std::ranges::count_if(
        text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; });
    return static_cast<double>(characters) * kCharacterWidth * font_size;
}

FigureLayout lay_out(const Figure& figure) {
    const std::size_t columns = std::max<std::size_t>(1, figure.columns);
    const std::size_t rows = (figure.panels.size() + columns - 1) / columns;
    std::vector<Margins> of_column(columns), of_row(rows);
    FigureLayout layout;
    for (std::size_t i = 0; i < figure.panels.size(); ++i) {
        const Panel& panel = figure.panels[i];
        const PanelLayout ranged =
            layout.panels.emplace_back(fit_panel(panel, figure.panel_width, figure.row_name_width));
        const Margins margins = margins_of(panel, ranged, figure.panel_width);
        Margins& column = of_column[i % columns];
        Margins& row = of_row[i / columns];
        column.left = std::max(column.left, margins.left);
        column.right = std::max(column.right, margins.right);
        row.top = std::max(row.top, margins.top);
        row.bottom = std::max(row.bottom, margins.bottom);
    }
    double top = figure.title.empty() ? kEdge : kTitleHeight;
    for (std::size_t row = 0; row < rows; ++row) {
        double left = kEdge;
        for (std::size_t column = 0; column < columns; ++column) {
            left += of_column[column].left;
            const std::size_t i = row * columns + column;
            if (i < layout.panels.size()) {
                layout.panels[i].area = {left, top + of_row[row].top,
                                         static_cast<double>(figure.panel_width),
                                         static_cast<double>(figure.panel_height)};
                place_legend(figure.panels[i], layout.panels[i]);
                place_point_names(figure.panels[i], layout.panels[i]);
            }
            left += figure.panel_width + of_column[column].right;
        }
        layout.width = static_cast<int>(std::ceil(left + kEdge));
        top += of_row[row].top + figure.panel_height + of_row[row].bottom + kPanelGap;
    }
    layout.width = std::max(layout.width,
                            static_cast<int>(2 * kEdge + text_width(figure.title, kTitleFontSize)));
    layout.footer = broken(figure.footer, layout.width - 2 * kEdge);
    if (!figure.footer.empty())
        top += 2 * kFooterGap + static_cast<double>(line_count(layout.footer)) * kLineHeight;
    layout.height = static_cast<int>(std::ceil(top));
    return layout;
}

Figure fitted(const Figure& figure, int width) {
    Figure result = figure;
    result.title.clear();
    result.footer.clear();
    const auto shrink = [&] {
        const int columns = static_cast<int>(std::max<std::size_t>(1, result.columns));
        const int excess = lay_out(result).width - width;
        if (excess > 0) result.panel_width -= (excess + columns - 1) / columns;
    };
    shrink();
    if (result.panel_width >= kLeastColumnWidth) return result;
    result.columns = 1;
    result.panel_width = figure.panel_width;
    number_points(result);
    for (std::size_t i = 0; i < result.panels.size(); ++i) {
        Panel& panel = result.panels[i];
        panel.row_notes.clear();
        // A panel without a legend shares that of its neighbour.
        if (panel.legend == Legend::kNone && i + 1 < result.panels.size() && figure.columns > 1)
            panel.legend = result.panels[i + 1].legend;
        if (panel.legend != Legend::kNone) panel.legend = Legend::kAbove;
    }
    shrink();
    int least = kLeastWidth;
    for (const Panel& panel : result.panels) {
        if (!panel.y.names.empty())
            least = std::max(least, static_cast<int>(panel.x.names.size()) * kLeastCellWidth);
    }
    if (result.panel_width >= least) return result;
    double widest = 0;
    for (const Panel& panel : result.panels)
        for (const std::string& name : panel.y.names) widest = std::max(widest, widest_line(name));
    result.row_name_width = std::max(kLeastNameWidth, widest - (least - result.panel_width));
    result.panel_width = least;
    for (const PanelLayout& panel : lay_out(result).panels) {
        std::size_t lines = 0;
        for (const std::string& name : panel.y_names) lines = std::max(lines, line_count(name));
        const auto height = static_cast<double>(panel.y_names.size() * lines) * kLineHeight;
        result.panel_height = std::max(result.panel_height, static_cast<int>(height));
    }
    return result;
}

}  // namespace mray::plot
