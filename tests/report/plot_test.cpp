// Figures that matplotlib draws from a CSV file, and what is said where it cannot.
#include "report/plot.h"

#include <gtest/gtest.h>

#include "tests/support/thrown_error.h"

namespace mray::plot {
namespace {

constexpr const char* kCsv =
    "name,x,y,least,most,disturbed\na,0,1,0,9,\na,10,100,5,20,\n"
    "b c,10,0,5,20,\nb c,1000,50,900,2000,disturbed\n";

Figure figure_of(const char* kind) {
    return {.title = "it's 'one' \"two\" $three `four`",
            .details = "a machine\nof\xff bytes",
            .panels = {{{"kind", kind},
                        {"x", "x"},
                        {"y", "y"},
                        {"xlower", "least"},
                        {"xupper", "most"},
                        {"lower", "y"},
                        {"upper", "y"},
                        {"family", "name"},
                        {"label", "name"},
                        {"front", "best"},
                        {"series", "name"}}}};
}

TEST(Plot, DrawsTitlesNamesAndAPlaceForZero) {
    for (const bool narrow : {false, true}) {
        for (const char* kind : {"lines", "points"}) {
            const std::string svg = draw(figure_of(kind), kCsv, "svg", narrow);
            EXPECT_TRUE(test::has(svg, "<svg"));
            EXPECT_TRUE(test::has(svg, "$three `four`")) << kind;
            EXPECT_TRUE(test::has(svg, "b c")) << kind;
            EXPECT_EQ(test::has(svg, ">none<"), kind == std::string("points"));
            EXPECT_TRUE(test::has(svg, "(disturbed)") || test::has(svg, ">~b c<")) << kind;
            EXPECT_TRUE(test::has(svg, "a machine of")) << kind;
            // A front says what no other beats, which a disturbed speed does not tell.
            EXPECT_FALSE(test::has(svg, ">best<")) << kind;
            EXPECT_EQ(draw(figure_of(kind), kCsv, "svg", narrow), svg) << kind;
        }
    }
    EXPECT_EQ(draw(figure_of("lines"), kCsv, "png").substr(1, 3), "PNG");
    const std::string calm(kCsv, std::string_view(kCsv).rfind("disturbed"));
    EXPECT_TRUE(test::has(draw(figure_of("points"), calm + "\n", "svg"), ">best<"));
}

TEST(Plot, SaysThatMatplotlibFails) {
    const auto draw_nothing = [] {
        draw({.title = "Trees", .panels = {{{"kind", "rings"}}}}, "", "svg");
    };
    EXPECT_EQ(test::message_of(draw_nothing), "Trees: matplotlib failed; its message is above");
}

}  // namespace
}  // namespace mray::plot
