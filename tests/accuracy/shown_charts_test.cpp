// The page of charts in a browser: on a phone and a desktop, by day and night, and on paper.
#include <gtest/gtest.h>

#include "accuracy/charts/chart_page.h"
#include "clips/procedural/procedural.h"
#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "tests/support/browser.h"

namespace mray::test {
namespace {

const accuracy::Effort kQuick{.side = 64,
                              .aimed_rays = 600,
                              .rounds = 2,
                              .placed_rays = 300,
                              .offsets = {1e3},
                              .scales = {1e-6, 1},
                              .policy_frames = 9,
                              .cone_points = 2,
                              .triangle_counts = {500, 1000}};

std::vector<accuracy::Chart> little_charts() {
    const accuracy::ChartContext context{
        .effort = kQuick,
        .make_cpu_backend = [] { return cpu::make_cpu_backend({}); },
        .make_vulkan_backend = []() -> std::unique_ptr<Backend> {
            throw Error(ErrorKind::kUnavailable, "not in this test");
        },
        .footer = "machine; command",
        .step = [] {}};
    SceneFrames scene(make_procedural("cloth", 500));
    const std::span<const vec3> positions = scene.positions(12);
    const accuracy::ChartInput input{
        "cloth", scene.clip().topology(), {positions.begin(), positions.end()}};
    std::vector<accuracy::Chart> charts;
    charts.push_back(accuracy::accuracy_chart(context, input, ""));
    charts.push_back(accuracy::packet_chart(context, input, ""));
    charts.push_back(accuracy::box_chart(context, input, ""));
    charts.push_back(accuracy::policy_chart(context, scene, ""));
    charts.push_back(accuracy::tree_chart(context, scene, ""));
    charts.push_back(accuracy::scaling_chart(context));
    return charts;
}

const std::vector<accuracy::PagedChart>& little_paged() {
    static const std::vector<accuracy::Chart> charts = little_charts();
    static const std::vector<accuracy::PagedChart> paged = [] {
        std::vector<accuracy::PagedChart> made;
        for (const accuracy::Chart& chart : charts) made.push_back(accuracy::page_chart(chart));
        return made;
    }();
    return paged;
}

std::string little_page() { return accuracy::chart_page(little_paged(), "machine", "command"); }

TEST(PagedCharts, NameTheNumbersOfPointsBelowTheImageForPhones) {
    const accuracy::PagedChart& accuracy = little_paged()[0];
    std::string list = "<ol class=\"phone\">";
    for (const plot::PointName& name : accuracy.chart->figure.panels[0].point_names) {
        const std::string shown = ">" + name.text + "<";
        EXPECT_NE(accuracy.svg.find(shown), std::string::npos) << name.text;
        EXPECT_EQ(accuracy.phone_svg.find(shown), std::string::npos) << name.text;
        list += "<li>" + name.text + "</li>";
    }
    EXPECT_GT(accuracy.phone_key.size(), 5u);
    const std::string page = little_page();
    EXPECT_NE(page.find("</div>\n" + list + "</ol>"), std::string::npos);
    // No other chart has names of points.
    EXPECT_EQ(page.find("<ol"), page.rfind("<ol"));
}

class ShownCharts : public testing::Test {
protected:
    void SetUp() override {
        if (!has_browser()) GTEST_SKIP() << kNoBrowser;
    }
};

TEST_F(ShownCharts, HaveOneSizeOfTypeOnPhonesAndDesktopsByDayAndNight) {
    const std::string page = little_page();
    for (const int width : {390, 1280}) {
        for (const bool dark : {false, true}) {
            const ShownPage shown = show_page(page, width, dark, "chart");
            EXPECT_LE(shown.content_width, width);
            EXPECT_EQ(shown.drawing_excess, 0) << width;
            EXPECT_EQ(shown.least_text_px, 14);
            EXPECT_EQ(shown.background < 60, dark) << shown.background;
            EXPECT_EQ(shown.foreground > 180, dark) << shown.foreground;
            EXPECT_NE(shown.text.find("What the words mean"), std::string::npos);
        }
    }
}

TEST_F(ShownCharts, SayOnPaperWhatTheirAxesMean) {
    const std::string text = printed_text(little_page(), "chart");
    for (const char* part : {"Mray/s, camera rays on ", "rules (scalar, single rays)",
                             "rays of a packet", "refit", "rebuild", "every:4", "auto"})
        EXPECT_NE(text.find(part), std::string::npos) << part << '\n' << text;
}

}  // namespace
}  // namespace mray::test
