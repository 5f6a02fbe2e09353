#include "tools/plot/gnuplot_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/text/utf8.h"
#include "tools/plot/layout.h"

namespace mray::plot {
namespace {

/// The dashes of a sample of a dashed line in a legend: their number and their length in pixels.
constexpr int kLegendDashes = 3;
constexpr double kLegendDash = 8;

std::string colour_text(std::uint32_t colour) { return fmt::format("rgb '#{:06x}'", colour); }

/// Writes the parts of one figure.
class ScriptWriter {
public:
    explicit ScriptWriter(const Figure& figure) : figure_(figure), layout_(lay_out(figure)) {}

    /// The points of all panels as named blocks.
    std::string data() const {
        std::string text;
        for (std::size_t p = 0; p < figure_.panels.size(); ++p) {
            const Panel& panel = figure_.panels[p];
            const PanelLayout& layout = layout_.panels[p];
            for (std::size_t c = 0; c < panel.curves.size(); ++c) {
                text += fmt::format("${} << END_OF_DATA\n", curve_name(p, c));
                const Curve& curve = panel.curves[c];
                for (std::size_t i = 0; i < curve.points.size(); ++i) {
                    text += fmt::format("{} {}", layout.x.place(curve.points[i].x),
                                        layout.y.place(curve.points[i].y));
                    if (!curve.ranges.empty()) {
                        text += fmt::format(" {} {}", layout.y.place(curve.ranges[i].least),
                                            layout.y.place(curve.ranges[i].most));
                    }
                    text += '\n';
                }
                text += "END_OF_DATA\n";
            }
            if (!panel.rectangles.empty()) text += rectangle_data(p);
        }
        return text;
    }

    std::string image(const Output& output) const {
        const bool png = output.image == Image::kPng;
        // pngcairo takes points of 1/72 inch at 96 pixels an inch.
        std::string text =
            fmt::format("set terminal {} size {},{} font 'Helvetica,{}' background '#ffffff'\n",
                        png ? "pngcairo" : "svg", layout_.width, layout_.height,
                        png ? kFontSize * 0.75 : kFontSize);
        if (!output.file.empty())
            text += fmt::format("set output {}\n", single_quoted(output.file));
        text += "set encoding utf8\nset multiplot\n";
        text += fmt::format("set border 3 lc {}\n", colour_text(kGuideColour));
        text += fmt::format("set tics nomirror out scale 0.5 tc {}\n", colour_text(kTextColour));
        for (std::size_t p = 0; p < figure_.panels.size(); ++p) text += panel(p, png);
        return text + "unset multiplot\nunset output\n";
    }

private:
    static std::string curve_name(std::size_t panel, std::size_t curve) {
        return fmt::format("curve_{}_{}", panel, curve);
    }

    std::string rectangle_data(std::size_t p) const {
        std::string text = fmt::format("$rectangles_{} << END_OF_DATA\n", p);
        for (const Rectangle& r : figure_.panels[p].rectangles) {
            text += fmt::format("{} {} {} {} {} {} {}\n", (r.first.x + r.second.x) / 2,
                                (r.first.y + r.second.y) / 2, r.first.x, r.second.x, r.first.y,
                                r.second.y, r.colour);
        }
        return text + "END_OF_DATA\n";
    }

    /// Pixels as parts of the image, from its left and lower edge.
    double across(double x) const { return x / layout_.width; }
    double up(double y) const { return 1 - y / layout_.height; }
    std::string screen(double x, double y) const {
        return fmt::format("screen {:.6f}, screen {:.6f}", across(x), up(y));
    }

    static std::string font(double size, bool png) {
        return fmt::format("font ',{}'", png ? size * 0.75 : size);
    }

    std::string title_and_footer(bool png) const {
        return fmt::format("set label {} at {} left noenhanced {} tc {}\n",
                           single_quoted(figure_.title), screen(16, 24), font(kTitleFontSize, png),
                           colour_text(0)) +
               fmt::format("set label {} at {} left noenhanced {} tc {}\n",
                           double_quoted(layout_.footer),
                           screen(16, layout_.height - 14 -
                                          kLineHeight * static_cast<double>(std::ranges::count(
                                                            layout_.footer, '\n'))),
                           font(kFontSize, png), colour_text(kPaleTextColour));
    }

    std::string texts(std::size_t p, bool png) const {
        const Panel& panel = figure_.panels[p];
        const PanelLayout& layout = layout_.panels[p];
        std::string text;
        const auto add = [&](const std::string& label, Point at, const char* side,
                             std::uint32_t colour) {
            text += fmt::format("set label {} at {} {} noenhanced front {} tc {}\n",
                                single_quoted(label), screen(at.x, at.y), side,
                                font(kFontSize, png), colour_text(colour));
        };
        for (const CentredText& centred : panel.texts) {
            Point at = layout.pixel(centred.at);
            at.y += centred.lines_down * kLineHeight;
            add(centred.text, at, "center", centred.colour);
        }
        for (const RowNote& note : panel.row_notes) {
            const double y = layout.pixel({0, note.y}).y;
            add(note.text, {layout.area.right() + 8, y}, "left", kTextColour);
        }
        for (std::size_t i = 0; i < panel.point_names.size(); ++i) {
            const PointName& name = panel.point_names[i];
            const PlacedName& placed = layout.names[i];
            const Point at = layout.pixel(name.at);
            const double y = placed.box.top + placed.box.height / 2;
            // The side of the box that is next to the point.
            const bool right = placed.box.left > at.x;
            const double x = right ? placed.box.left : placed.box.right();
            add(name.text, {x, y}, right ? "left" : "right", name.colour);
            if (!placed.has_leader) continue;
            text += fmt::format("set arrow from {} to {} nohead lw 0.7 lc {}\n", screen(at.x, at.y),
                                screen(right ? x - 2 : x + 2, y), colour_text(name.colour));
        }
        return text;
    }

    static std::string ticks(char axis, const Axis& given, const AxisRange& range,
                             const std::vector<std::string>& broken_names, bool png) {
        std::string places;
        for (std::size_t i = 0; i < range.ticks.size(); ++i) {
            const std::string& name = broken_names.empty() ? range.ticks[i].text : broken_names[i];
            places +=
                fmt::format("{}{} {}", i == 0 ? "" : ", ", double_quoted(name), range.ticks[i].at);
        }
        return fmt::format("set {}tics ({}) {} {}\n", axis, places,
                           given.names.empty() ? "enhanced" : "noenhanced", font(kFontSize, png));
    }

    std::string axes(std::size_t p, bool png) const {
        const Panel& panel = figure_.panels[p];
        const PanelLayout& layout = layout_.panels[p];
        std::string text = fmt::format(
            "set lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\n"
            "set tmargin at screen {:.6f}\nset bmargin at screen {:.6f}\n",
            across(layout.area.left), across(layout.area.right()), up(layout.area.top),
            up(layout.area.bottom()));
        text += "unset logscale\n";
        // Cells of a map need no grid.
        const bool is_map = !panel.x.names.empty() && !panel.y.names.empty();
        text += is_map ? "unset grid\n"
                       : fmt::format("set grid back lt 1 lw 1 lc {}\n", colour_text(kGridColour));
        for (const auto& [axis, range] : {std::pair('x', &layout.x), std::pair('y', &layout.y)}) {
            if (range->log_base != 0)
                text += fmt::format("set logscale {} {}\n", axis, range->log_base);
            text += fmt::format("set {}range [{}:{}]\n", axis, range->lower, range->upper);
        }
        text += ticks('x', panel.x, layout.x, layout.x_names, png);
        text += ticks('y', panel.y, layout.y, layout.y_names, png);
        text += fmt::format("set xlabel {} noenhanced\nset ylabel {} noenhanced\n",
                            double_quoted(layout.x_title), single_quoted(panel.y.title));
        if (layout.x.zero_at > 0) {
            text += fmt::format(
                "set arrow from {0}, graph 0 to {0}, graph 1 nohead back lw 1.5 lc {1}\n",
                layout.x.zero_at, colour_text(kGuideColour));
        }
        const double above = 12 + layout.legend_height;
        text +=
            fmt::format("set label {} at {} left noenhanced tc {}\n", single_quoted(panel.title),
                        screen(layout.area.left, layout.area.top - above), colour_text(0));
        return text;
    }

    /// gnuplot's own legend breaks its rows at places that cannot be known beforehand.
    std::string legend(std::size_t p) const {
        std::string text;
        for (const LegendEntry& entry : layout_.panels[p].legend) {
            const double y = entry.box.top + entry.box.height / 2;
            const double left = entry.box.left;
            const double right = left + kLegendSample;
            const std::string colour = colour_text(entry.style.colour);
            text += fmt::format("set label {} at {} left noenhanced front tc {}\n",
                                single_quoted(entry.text), screen(entry.text_left, y),
                                colour_text(kTextColour));
            if (!entry.is_curve) {
                text += fmt::format("set object rectangle from {} to {} fs solid noborder fc {}\n",
                                    screen(left, y + 5), screen(right, y - 5), colour);
                continue;
            }
            // In SVG, gnuplot joins lines of one colour that follow each other, and all of them are
            // dashed as the first one is.
            const double dash = entry.style.dashed ? kLegendDash : kLegendSample;
            const double gap = (kLegendSample - kLegendDashes * kLegendDash) / (kLegendDashes - 1);
            for (double x = left; entry.style.line && x < right; x += dash + gap) {
                text +=
                    fmt::format("set arrow from {} to {} nohead front lc {} lw {}\n", screen(x, y),
                                screen(x + dash, y), colour, entry.style.line_width);
            }
            if (entry.style.symbols) {
                text +=
                    fmt::format("set label '' at {} front point lc {}{}\n",
                                screen((left + right) / 2, y), colour, symbol_text(entry.style));
            }
        }
        return text;
    }

    static std::string line_text(const Style& style) {
        return fmt::format(" lw {}{}", style.line_width, style.dashed ? " dt (6,4)" : "");
    }
    static std::string symbol_text(const Style& style) {
        return fmt::format(" pt {} ps {}", style.symbol, style.symbol_size);
    }

    static std::string style_text(const Style& style) {
        const char* kind = !style.symbols ? "lines" : style.line ? "linespoints" : "points";
        std::string text = fmt::format("with {} lc {}", kind, colour_text(style.colour));
        if (style.line) text += line_text(style);
        if (style.symbols) text += symbol_text(style);
        return text;
    }

    std::string panel(std::size_t p, bool png) const {
        const Panel& panel = figure_.panels[p];
        std::string text = "unset label\nunset arrow\nunset object\nunset key\n";
        if (p == 0) text += title_and_footer(png);
        text += axes(p, png) + texts(p, png) + legend(p);
        // gnuplot refuses to draw nothing at all.
        text += "plot NaN notitle";
        if (!panel.rectangles.empty()) {
            text += fmt::format(
                ", $rectangles_{} using 1:2:3:4:5:6:7 with boxxyerror fs solid noborder lc rgb "
                "variable notitle",
                p);
        }
        for (std::size_t c = 0; c < panel.curves.size(); ++c) {
            const Curve& curve = panel.curves[c];
            if (curve.points.empty()) continue;
            if (!curve.ranges.empty()) {
                text += fmt::format(", ${} using 1:2:3:4 with yerrorbars pt -1 lw 1 lc {} notitle",
                                    curve_name(p, c), colour_text(curve.style.colour));
            }
            text += fmt::format(
                ", ${} using 1:2 {} {}", curve_name(p, c), style_text(curve.style),
                curve.title.empty() ? "notitle" : "title " + single_quoted(curve.title));
        }
        return text + "\n";
    }

    const Figure& figure_;
    FigureLayout layout_;
};

}  // namespace

std::string script_of(const Figure& figure, const std::vector<Output>& outputs) {
    const ScriptWriter writer(figure);
    std::string text = "# Draw with gnuplot.\n" + writer.data();
    for (const Output& output : outputs) text += writer.image(output);
    return text;
}

std::string single_quoted(std::string_view text) {
    std::string result = "'";
    for (const char c : utf8_text(text)) {
        if (c == '\n' || c == '\r') continue;
        result.append(c == '\'' ? 2 : 1, c);
    }
    return result + "'";
}

std::string double_quoted(std::string_view text) {
    std::string result = "\"";
    for (const char c : utf8_text(text)) {
        if (c == '\n') {
            result += "\\n";
        } else {
            if (c == '"' || c == '\\') result += '\\';
            if (c != '\r') result += c;
        }
    }
    return result + "\"";
}

}  // namespace mray::plot
