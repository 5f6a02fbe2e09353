// The page of a cross-check in a browser: on a phone and a desktop, by day and night, and on paper.
#include <gtest/gtest.h>

#include "app/report/crosscheck/crosscheck_html.h"
#include "tests/app/crosscheck/planted_checks.h"
#include "tests/support/browser.h"

namespace mray::test {
namespace {

constexpr int kPhone = 390;
constexpr int kDesktop = 1280;

std::string shown_page_of(const app::CheckRun& run) {
    app::Options options;
    options.view.width = run.scenes[0].head.width;
    options.view.height = run.scenes[0].head.height;
    return app::to_html(options, run);
}

class ShownCrosscheck : public testing::Test {
protected:
    void SetUp() override {
        if (!has_browser()) GTEST_SKIP() << kNoBrowser;
    }
};

TEST_F(ShownCrosscheck, FitsPhonesAndDesktopsByDayAndNight) {
    const std::string page = shown_page_of(planted_run(12, 4, 16));
    for (const int width : {kPhone, kDesktop}) {
        for (const bool dark : {false, true}) {
            const ShownPage shown = show_page(page, width, dark, "crosscheck");
            EXPECT_LE(shown.content_width, width);
            EXPECT_GE(shown.least_text_px, 12);
            EXPECT_EQ(shown.background < 60, dark) << shown.background;
            EXPECT_EQ(shown.foreground > 180, dark) << shown.foreground;
            EXPECT_NE(shown.text.find("24 of 72 images differ"), std::string::npos);
            EXPECT_NE(shown.text.find("5 differ"), std::string::npos);
        }
    }
}

TEST_F(ShownCrosscheck, IsWholeOnPaper) {
    // Three frames side by side, many frames one below the other, and values of pixels.
    const std::string wide = printed_text(shown_page_of(planted_run(3, 1, 16)), "crosscheck-wide");
    for (const char* part : {"frame 0", "frame 1", "frame 2", "5 differ", "trees refitted",
                             "The first pixels that differ", "occluded", "0x1.800002p+0"})
        EXPECT_NE(wide.find(part), std::string::npos) << part << '\n' << wide;
    // The last column: the colour of the pixel whose colour differs.
    EXPECT_NE(wide.find("colour"), std::string::npos) << wide;
    EXPECT_NE(wide.find("morphray probe"), std::string::npos);
    EXPECT_EQ(wide.find("Flicker"), std::string::npos);
    EXPECT_EQ(wide.find("Copy"), std::string::npos);
    const std::string tall =
        printed_text(shown_page_of(planted_run(40, 40, 16)), "crosscheck-tall");
    EXPECT_NE(tall.find("39"), std::string::npos);
    EXPECT_NE(tall.find("trees refitted on cpu and vulkan"), std::string::npos);
}

}  // namespace
}  // namespace mray::test
