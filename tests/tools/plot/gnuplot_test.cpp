// The images that gnuplot draws, by the places of their texts.
#include "tools/plot/gnuplot.h"

#include <gtest/gtest.h>

#include <regex>

#include "common/base/errors.h"
#include "tests/support/temporary_folder.h"
#include "tests/tools/plot/figures.h"
#include "tools/plot/gnuplot_script.h"
#include "tools/plot/layout.h"

namespace mray::plot {
namespace {

struct SvgText {
    Point at;
    bool ends_there = false;
    std::string text;
};

/// The texts of an SVG file with the places that they begin or end at.
std::vector<SvgText> texts_of(const std::string& svg) {
    const std::regex group(
        R"re(<g transform="translate\(([0-9.]+),([0-9.]+)\)[^>]*text-anchor="(\w+)">\s*<text>(?:<tspan[^>]*>)?([^<]*)<)re");
    std::vector<SvgText> texts;
    for (std::sregex_iterator match(svg.begin(), svg.end(), group), end; match != end; ++match) {
        texts.push_back(
            {{std::stod((*match)[1]), std::stod((*match)[2])}, (*match)[3] == "end", (*match)[4]});
    }
    return texts;
}

TEST(Gnuplot, DrawsLegendsOutsideTheAreasOfAllPanels) {
    const test::TemporaryFolder folder;
    const Figure figure = test::all_panels();
    const FigureLayout layout = lay_out(figure);
    draw(figure, folder.file("figure.svg"));
    const std::vector<SvgText> texts = texts_of(test::read_file(folder.file("figure.svg")));
    std::size_t found = 0;
    for (const SvgText& text : texts) {
        bool is_legend = false;
        for (const Panel& panel : figure.panels) {
            for (const Curve& curve : panel.curves) is_legend |= curve.title == text.text;
            for (const ColourName& name : panel.colour_names) is_legend |= name.text == text.text;
        }
        if (!is_legend) continue;
        ++found;
        EXPECT_FALSE(text.ends_there) << text.text;
        EXPECT_LE(text.at.x + text_width(text.text, kFontSize), layout.width) << text.text;
        for (const PanelLayout& panel : layout.panels) {
            const Box box{text.at.x, text.at.y - kFontSize, text_width(text.text, kFontSize),
                          kFontSize};
            EXPECT_FALSE(panel.area.overlaps(box)) << text.text;
        }
    }
    // 3 and 9 curves, 2 colours, 1 set of points.
    EXPECT_EQ(found, 15u);
}

TEST(Gnuplot, DrawsPngFiles) {
    const test::TemporaryFolder folder;
    draw(test::all_panels(), folder.file("figure.png"));
    EXPECT_EQ(test::read_file(folder.file("figure.png")).substr(1, 3), "PNG");
}

TEST(Gnuplot, FailsWithItsOwnMessage) {
    const test::TemporaryFolder folder;
    folder.write("bad.gp", "plot nonsense(\n");
    try {
        run_gnuplot(folder.path().string(), "bad.gp");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInternal);
        EXPECT_NE(std::string(error.what()).find("bad.gp: gnuplot: "), std::string::npos);
    }
}

TEST(GnuplotScript, ReadsNoOtherFileAndQuotesNames) {
    Figure figure = test::all_panels();
    figure.panels[0].curves[0].title = "it's 'one' \"two\" $three";
    figure.panels[2].y.names[0] = "back\\slash \"quoted\"";
    const std::string script = script_of(figure, {{Image::kSvg, "a.svg"}, {Image::kPng, "a.png"}});
    EXPECT_NE(script.find("title 'it''s ''one'' \"two\" $three'"), std::string::npos);
    EXPECT_NE(script.find(R"("back\\slash \"quoted\"" 0)"), std::string::npos);
    EXPECT_EQ(script.find(".csv"), std::string::npos);
    EXPECT_NE(script.find("set output 'a.png'"), std::string::npos);
}

TEST(GnuplotScript, DrawsRangesAsBars) {
    Figure figure{.panels = {test::curve_panel(10, 2)}};
    EXPECT_EQ(script_of(figure, {{}}).find("yerrorbars"), std::string::npos);
    figure.panels[0].curves[1].ranges = {{1, 2}, {2, 4}, {3, 3}};
    const std::string script = script_of(figure, {{}});
    EXPECT_NE(script.find("$curve_0_1 using 1:2:3:4 with yerrorbars"), std::string::npos);
    EXPECT_NE(script.find("$curve_0_1 << END_OF_DATA\n1 1 1 2\n5 3 2 4\n"), std::string::npos);
    EXPECT_EQ(script.find("$curve_0_0 using 1:2:3:4"), std::string::npos);
}

TEST(GnuplotScript, DrawsSamplesOfDashedLinesAsDashes) {
    Figure figure{.panels = {test::curve_panel(10, 1)}};
    const auto arrows = [](const std::string& script) {
        std::size_t count = 0;
        for (std::size_t at = 0; (at = script.find("set arrow from", at)) != std::string::npos;
             ++at)
            ++count;
        return count;
    };
    EXPECT_EQ(arrows(script_of(figure, {{}})), 1u);
    figure.panels[0].curves[0].style.dashed = true;
    const std::string dashed = script_of(figure, {{}});
    EXPECT_EQ(arrows(dashed), 3u);
    EXPECT_NE(dashed.find("with linespoints"), std::string::npos);
    EXPECT_NE(dashed.find(" dt (6,4)"), std::string::npos);
}

TEST(GnuplotText, DoublesQuotesAndDropsLineEnds) {
    EXPECT_EQ(single_quoted("it's\none"), "'it''sone'");
}

}  // namespace
}  // namespace mray::plot
