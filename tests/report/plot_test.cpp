// Figures that gnuplot draws from a CSV file, and what is said where it cannot.
#include "report/plot.h"

#include <gtest/gtest.h>

#include "tests/support/thrown_error.h"

namespace mray::plot {
namespace {

constexpr const char* kCsv = "name,x,y\na,0,1\na,10,100\nb c,10,0\nb c,1000,50\n";

Figure figure_of(const char* kind) {
    return {
        .title = "it's 'one' \"two\" $three `four`",
        .panels = {{{"kind", kind}, {"x", "x"}, {"y", "y"}, {"series", "name"}, {"logx", "10"}}}};
}

TEST(Plot, DrawsTitlesNamesAndAPlaceForZero) {
    for (const char* kind : {"lines", "points"}) {
        const std::string svg = draw(figure_of(kind), kCsv, "svg");
        EXPECT_TRUE(test::has(svg, "<svg"));
        EXPECT_TRUE(test::has(svg, "$three `four`")) << kind;
        EXPECT_TRUE(test::has(svg, "b c")) << kind;
        EXPECT_TRUE(test::has(svg, "none<")) << kind;
        EXPECT_EQ(draw(figure_of(kind), kCsv, "png").substr(1, 3), "PNG");
    }
}

TEST(Plot, SaysThatGnuplotFails) {
    const auto draw_nothing = [] {
        draw({.title = "Trees", .panels = {{{"kind", "lines"}}}}, "", "svg");
    };
    EXPECT_EQ(test::message_of(draw_nothing), "Trees: gnuplot failed; its message is above");
}

}  // namespace
}  // namespace mray::plot
