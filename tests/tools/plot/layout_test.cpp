// Places of the parts of a figure: nothing covers anything else.
#include "tools/plot/layout.h"

#include <gtest/gtest.h>

#include "tests/tools/plot/figures.h"

namespace mray::plot {
namespace {

TEST(PlaceNames, NoNameCoversAnotherOrAPoint) {
    const Box area{0, 0, 500, 400};
    std::vector<NameRequest> requests;
    for (int i = 0; i < 24; ++i)
        requests.push_back({{250 + (i % 3) * 2.0, 200 + (i % 5) * 3.0}, 70.0 + 5 * (i % 4), 13});
    const std::vector<PlacedName> placed = place_names(requests, area);
    for (std::size_t i = 0; i < placed.size(); ++i) {
        EXPECT_TRUE(area.contains(placed[i].box)) << i;
        for (std::size_t j = 0; j < placed.size(); ++j) {
            if (i != j) {
                EXPECT_FALSE(placed[i].box.overlaps(placed[j].box)) << i << ' ' << j;
            }
            const Box point{requests[j].at.x - 1, requests[j].at.y - 1, 2, 2};
            EXPECT_FALSE(placed[i].box.overlaps(point)) << i << ' ' << j;
        }
    }
}

TEST(PlaceNames, NoLineToANameCrossesAnother) {
    // A column below the upper edge, and one above the lower edge: names must go elsewhere there.
    for (const double top : {8.0, 230.0}) {
        std::vector<NameRequest> requests;
        for (int i = 0; i < 12; ++i) requests.push_back({{20, top + 5.0 * i}, 16, 16});
        const std::vector<PlacedName> placed = place_names(requests, {0, 0, 240, 300});
        std::size_t lines = 0;
        for (std::size_t i = 0; i < placed.size(); ++i) {
            if (!placed[i].has_leader) continue;
            ++lines;
            const Box& name = placed[i].box;
            const Point from = requests[i].at;
            const Point to{name.left > from.x ? name.left : name.right(),
                           name.top + name.height / 2};
            for (std::size_t j = 0; j < placed.size(); ++j) {
                for (int k = 0; k <= 1000 && j != i; ++k) {
                    const double part = k / 1000.0;
                    const Box dot{from.x + part * (to.x - from.x), from.y + part * (to.y - from.y),
                                  0, 0};
                    ASSERT_FALSE(placed[j].box.overlaps(dot)) << top << ' ' << i << ' ' << j;
                }
            }
        }
        EXPECT_GT(lines, 3u) << top;
    }
}

TEST(PlaceNames, ANameAloneStandsBesideItsPoint) {
    const std::vector<NameRequest> requests{{{50, 50}, 40, 13}};
    const std::vector<PlacedName> placed = place_names(requests, {0, 0, 200, 100});
    EXPECT_FALSE(placed[0].has_leader);
    EXPECT_NEAR(placed[0].box.left, 62, 1);
    EXPECT_EQ(placed[0].box.top + placed[0].box.height / 2, 50);
}

TEST(PlaceNames, ANameWithoutRoomIsNotLeftOut) {
    const std::vector<NameRequest> requests{{{50, 50}, 400, 13}};
    EXPECT_EQ(place_names(requests, {0, 0, 100, 100}).size(), 1u);
}

TEST(Layout, LegendsAndAreasDoNotMeetAndAreInsideTheFigure) {
    const FigureLayout layout = lay_out(test::all_panels());
    const Box whole{0, 0, static_cast<double>(layout.width), static_cast<double>(layout.height)};
    std::vector<Box> boxes;
    for (const PanelLayout& panel : layout.panels) {
        boxes.push_back(panel.area);
        for (const LegendEntry& entry : panel.legend) boxes.push_back(entry.box);
    }
    // 4 areas; 3 and 9 curves, 2 colours, 1 set of points.
    ASSERT_EQ(boxes.size(), 4 + 15u);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        EXPECT_TRUE(whole.contains(boxes[i])) << i;
        for (std::size_t j = 0; j < i; ++j)
            EXPECT_FALSE(boxes[i].overlaps(boxes[j])) << i << ' ' << j;
    }
}

TEST(Layout, EveryPointIsWithinItsArea) {
    const Figure figure = test::all_panels();
    const FigureLayout layout = lay_out(figure);
    for (std::size_t p = 0; p < figure.panels.size(); ++p) {
        const Box& area = layout.panels[p].area;
        for (const Curve& curve : figure.panels[p].curves) {
            for (const Point& point : curve.points) {
                const Point at = layout.panels[p].pixel(point);
                EXPECT_GE(at.x, area.left - 1e-6);
                EXPECT_LE(at.x, area.right() + 1e-6);
                EXPECT_GE(at.y, area.top - 1e-6);
                EXPECT_LE(at.y, area.bottom() + 1e-6);
            }
        }
    }
}

TEST(Layout, AxesShowTheRangesOfPoints) {
    Figure figure{.panels = {test::curve_panel(10, 1)}};
    figure.panels[0].curves[0].ranges = {{1, 1}, {2, 70}, {2, 2}};
    EXPECT_GE(lay_out(figure).panels[0].y.upper, 70);
}

TEST(Layout, CurvesWithoutPointsAreNotInTheLegend) {
    Panel panel{.curves = {{"Embree", {}, {}}}};
    EXPECT_TRUE(lay_out({.panels = {panel}}).panels[0].legend.empty());
    panel.curves.push_back({"ours", {{1, 1}}, {}});
    const FigureLayout layout = lay_out({.panels = {panel}});
    ASSERT_EQ(layout.panels[0].legend.size(), 1u);
    EXPECT_EQ(layout.panels[0].legend[0].text, "ours");
}

TEST(Layout, TicksDoNotMeet) {
    for (const int width : {120, 200, 400, 800}) {
        for (const Scale scale : {Scale::kLinear, Scale::kLog10, Scale::kLog2}) {
            const Panel panel{.x = {.scale = scale, .zero_name = "none"},
                              .curves = {{"a", {{0, 1}, {1000, 2}, {100'000, 3}}, {}}}};
            const PanelLayout layout = lay_out({.panel_width = width, .panels = {panel}}).panels[0];
            ASSERT_GE(layout.x.ticks.size(), 2u);
            double right = -1000;
            for (const Tick& tick : layout.x.ticks) {
                const double half = text_width(tick.text, kFontSize) / 2;
                const double centre = layout.pixel({tick.at, 1}).x;
                // Powers are written smaller than their text is long.
                if (!tick.text.starts_with("10^")) {
                    EXPECT_GT(centre - half, right) << width << ' ' << tick.text;
                    right = centre + half;
                }
            }
        }
    }
}

TEST(Layout, NamesOfRowsAreBrokenForAPhone) {
    constexpr int kPhone = 358;
    Panel panel{.x = {.title = "length"}};
    for (const char* name : {"one", "a name that is much too long for a phone", "three"})
        add_bars(panel, name, {{3, kPalette[0]}}, "a note on the bars");
    const Figure figure{.panels = {panel}};
    EXPECT_EQ(lay_out(figure).panels[0].y_names, panel.y.names);
    const Figure narrow = fitted(figure, kPhone);
    const FigureLayout layout = lay_out(narrow);
    EXPECT_LE(layout.width, kPhone);
    EXPECT_GE(layout.panels[0].area.width, 200);
    EXPECT_EQ(layout.panels[0].y_names[0], "one");
    EXPECT_NE(layout.panels[0].y_names[1].find('\n'), std::string::npos);
    // Notes on rows have no place there.
    EXPECT_TRUE(narrow.panels[0].row_notes.empty());
}

TEST(Layout, PointsHaveNumbersOnAPhoneThatCoverNothing) {
    const Figure figure{
        .columns = 2, .panel_width = 520, .panels = {test::named_panel(), test::named_panel()}};
    EXPECT_TRUE(fitted(figure, 1400).key.empty());
    EXPECT_EQ(fitted(figure, 1400).panels[0].point_names[2].text, "method number 2");
    const Figure narrow = fitted(figure, 358);
    ASSERT_EQ(narrow.key.size(), 15u);
    const FigureLayout layout = lay_out(narrow);
    for (std::size_t p = 0; p < narrow.panels.size(); ++p) {
        const PanelLayout& panel = layout.panels[p];
        for (std::size_t i = 0; i < panel.names.size(); ++i) {
            const std::string& number = narrow.panels[p].point_names[i].text;
            EXPECT_EQ(narrow.key.at(std::stoul(number) - 1), figure.panels[p].point_names[i].text);
            EXPECT_TRUE(panel.area.contains(panel.names[i].box)) << number;
            for (std::size_t j = 0; j < i; ++j)
                EXPECT_FALSE(panel.names[i].box.overlaps(panel.names[j].box)) << i << ' ' << j;
        }
    }
}

TEST(Layout, CellsOfAMapHaveRoomForNumbersOnAPhone) {
    Panel panel{.x = {.names = {}}, .y = {.names = {"one", "two"}}, .legend = Legend::kNone};
    for (int i = 0; i < 14; ++i) panel.x.names.push_back("rule: Moeller-Trumbore");
    const FigureLayout layout = lay_out(fitted({.panels = {panel}}, 358));
    EXPECT_GE(layout.panels[0].area.width / 14, text_width("123456", kFontSize));
    EXPECT_EQ(layout.panels[0].x_names[0], "rule:\nMoeller-\nTrumbore");
}

TEST(Layout, TheFooterIsBrokenAtSpaces) {
    const FigureLayout layout = lay_out(test::all_panels());
    EXPECT_EQ(layout.footer.substr(38, 5), "ww\nxx");
    EXPECT_TRUE(layout.footer.ends_with("x\nend"));
}

TEST(Palette, StylesOfTheFirstCurvesDiffer) {
    for (std::size_t i = 0; i < 2 * kPalette.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            EXPECT_TRUE(style_of(i).colour != style_of(j).colour ||
                        style_of(i).dashed != style_of(j).dashed)
                << i << ' ' << j;
        }
    }
}

}  // namespace
}  // namespace mray::plot
