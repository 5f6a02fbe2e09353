// The page of a cross-check: what it says, and that it needs nothing but itself.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "app/report/crosscheck/check_report.h"
#include "app/report/crosscheck/crosscheck_html.h"
#include "common/text/utf8.h"
#include "tests/app/crosscheck/planted_checks.h"
#include "tests/support/temporary_folder.h"
#include "tools/process/shell_command.h"
#include "tools/process/shell_text.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostBytes = 5'000'000;

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
        ++found;
    return found;
}

Json embedded(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"report\">";
    const std::size_t from = page.find(begin);
    if (from == std::string::npos) return {};
    return Json::parse(
        page.substr(from + begin.size(), page.find("</script>", from) - from - begin.size()));
}

app::Options options_of(const app::CheckRun& run) {
    app::Options options;
    options.view.width = run.scenes[0].head.width;
    options.view.height = run.scenes[0].head.height;
    return options;
}

std::string page_of(const app::CheckRun& run) { return app::to_html(options_of(run), run); }

/// Elements open and close in pairs.
void expect_well_formed(const std::string& page) {
    std::vector<std::string> open;
    std::size_t at = page.find("<html");
    while ((at = page.find('<', at)) != std::string::npos) {
        // A ">" in quotes does not end a tag.
        std::size_t end = ++at;
        for (bool quoted = false; end < page.size() && (quoted || page[end] != '>'); ++end)
            quoted = quoted != (page[end] == '"');
        const std::string tag = page.substr(at, end - at);
        const std::string name = tag.substr(0, tag.find_first_of(" \n"));
        at = end;
        if (name == "meta" || name == "img" || name == "input") continue;
        if (!name.starts_with('/')) {
            open.push_back(name);
            if (name == "script" || name == "style") at = page.find("</" + name, at);
            continue;
        }
        ASSERT_FALSE(open.empty()) << name;
        EXPECT_EQ("/" + open.back(), name);
        open.pop_back();
    }
    EXPECT_TRUE(open.empty());
}

TEST(CrosscheckPage, BeginsWithTheVerdictInWords) {
    const std::string equal = page_of(planted_run(2, 2, 16));
    EXPECT_NE(equal.find("<title>Equal: morphray crosscheck</title>"), std::string::npos);
    EXPECT_NE(equal.find("<strong>Equal</strong> All 12 images are equal bit by bit."),
              std::string::npos);
    EXPECT_EQ(equal.find(" differ</a>"), std::string::npos);
    const std::string different = page_of(planted_run(2, 1, 16));
    EXPECT_NE(different.find("<strong>Different</strong> 3 of 12 images differ."),
              std::string::npos);
    EXPECT_LT(different.find("<strong>Different"), different.find("<table"));
}

TEST(CrosscheckPage, SaysThatARunEndedEarly) {
    app::CheckRun run = planted_run(2, 2, 16);
    run.scenes[0].complete = false;
    run.error = run.scenes[0].error = "Vulkan: the device <x> was lost";
    const std::string page = page_of(run);
    EXPECT_NE(page.find("<strong>Equal, not finished</strong>"), std::string::npos);
    EXPECT_NE(page.find("the device &lt;x&gt; was lost"), std::string::npos);
    EXPECT_EQ(embedded(page)["complete"], false);
}

TEST(CrosscheckPage, LinksEachCellToItsDifference) {
    const std::string page = page_of(planted_run(3, 1, 16));
    EXPECT_EQ(count(page, "\">5 differ</a>"), 6u);
    for (const int row : {7, 8, 9, 13, 14, 15}) {
        const std::string id = "scene-1-row-" + std::to_string(row) + "\"";
        EXPECT_EQ(count(page, "<a href=\"#" + id), 1u) << id;
        EXPECT_EQ(count(page, " id=\"" + id), 1u) << id;
    }
    EXPECT_EQ(count(page, ">equal</td>"), 12u + 3u);
    EXPECT_NE(page.find("5 pixels differ"), std::string::npos);
    EXPECT_NE(page.find("</span>1 false miss</li>"), std::string::npos);
    EXPECT_NE(page.find("</span>1 colour</li>"), std::string::npos);
    EXPECT_NE(page.find("<mark>0x1.800002p+0</mark>"), std::string::npos);
    EXPECT_NE(page.find("--pixel 1,1 "), std::string::npos);
    EXPECT_EQ(count(page, "<figure data-compare>"), 6u);
    expect_well_formed(page);
}

TEST(CrosscheckPage, EscapesWhatComesFromOutside) {
    const app::CheckRun run = planted_run(1, 0, 16);
    const std::string page = page_of(run);
    EXPECT_NE(
        page.find("<h2 id=\"scene-1\">a&amp;b &lt;&quot;'scene'&gt; &lt;/script&gt;.obj</h2>"),
        std::string::npos);
    // The elements of the page itself: data and script.
    EXPECT_EQ(count(page, "</script>"), 2u);
    EXPECT_EQ(page.find("<\"'scene'"), std::string::npos);
    expect_well_formed(page);
    EXPECT_EQ(embedded(page)["scene"], run.scenes[0].spec);
}

TEST(CrosscheckPage, ShowsBytesOfNamesThatAreNotUtf8) {
    app::CheckRun run = planted_run(1, 0, 16, "caf\xe9/\xc3\xa9.obj");
    run.scenes[0].warnings.push_back("caf\xe9: odd");
    const std::string page = page_of(run);
    EXPECT_EQ(utf8_text(page), page);
    EXPECT_NE(page.find("<h2 id=\"scene-1\">caf\\xE9/\xc3\xa9.obj</h2>"), std::string::npos);
    EXPECT_NE(page.find("<li>caf\\xE9: odd</li>"), std::string::npos);
    // A command to paste into a shell.
    EXPECT_NE(page.find("morphray probe $'caf\\xE9/\xc3\xa9.obj' --frame 0"), std::string::npos);
    expect_well_formed(page);
}

TEST(CrosscheckPage, SaysWhatDiffersWhereNothingIsSeen) {
    const std::string page = page_of(planted_step(16));
    EXPECT_NE(page.find(">1 differ (t)</a>"), std::string::npos);
    EXPECT_NE(page.find("primary: 1 pixel differs (t)</h3>"), std::string::npos);
    EXPECT_NE(page.find("Both images look the same"), std::string::npos);
    EXPECT_NE(page.find("<mark>0x1.800002p+0</mark> <small>+1 ulp</small>"), std::string::npos);
    EXPECT_EQ(page_of(planted_run(1, 0, 16)).find("look the same"), std::string::npos);
}

TEST(CrosscheckPage, OfManyFramesIsTall) {
    const std::string wide = page_of(planted_run(3, 1, 16));
    EXPECT_EQ(wide.find("<table class=\"matrix tall\">"), std::string::npos);
    const std::string tall = page_of(planted_run(12, 4, 16));
    EXPECT_NE(tall.find("<table class=\"matrix tall\">"), std::string::npos);
    // Two variants and the trees, whatever the number of frames.
    EXPECT_EQ(count(tall,
                    "<th scope=\"col\">1</th><th scope=\"col\">2</th><th "
                    "scope=\"col\">3</th></tr></thead>"),
              1u);
    EXPECT_EQ(count(tall, "<li>vulkan, refit"), 1u);
    EXPECT_EQ(count(tall, "<li>trees refitted on cpu and vulkan</li>"), 1u);
    EXPECT_EQ(count(tall, "<th scope=\"rowgroup\" rowspan=\"3\">"), 12u);
    EXPECT_EQ(count(tall, "\">5 differ</a>"), 24u);
    EXPECT_EQ(count(tall, ">equal</td>"), 12u * 6 - 24 + 12);
    expect_well_formed(tall);
}

TEST(CrosscheckPage, HasTheJsonOfTheReport) {
    const app::CheckRun run = planted_run(2, 1, 16);
    EXPECT_EQ(embedded(page_of(run)), Json::parse(app::to_json(run)));
}

TEST(CrosscheckPage, LoadsNothing) {
    const std::string page = page_of(planted_run(2, 0, 16));
    for (const char* part : {"http://", "https://", "//cdn", "@import", "url(", "<link", "<iframe"})
        EXPECT_EQ(page.find(part), std::string::npos) << part;
    EXPECT_EQ(count(page, "src=\""), count(page, "src=\"data:image/png;base64,"));
    EXPECT_EQ(count(page, "src=\""), 3u * 6u);
}

TEST(CrosscheckPage, OfFiveHundredComparisonsIsSmall) {
    // Noise is the worst that a PNG can hold.
    const std::string page = page_of(planted_run(84, 0, 300));
    EXPECT_GE(count(page, "<figure data-compare>"), 1u);
    EXPECT_LT(count(page, "<figure data-compare>"), 8u);
    EXPECT_EQ(count(page, "<section>"), 100u);
    EXPECT_NE(page.find("152 more images differ"), std::string::npos);
    EXPECT_LT(page.size(), kMostBytes);
    EXPECT_EQ(embedded(page)["rows"].size(), 504u);
    expect_well_formed(page);
}

TEST(CrosscheckPage, ShowsThePartOfALargeImageThatDiffers) {
    const Frame expected = numbered_frame(700, 300);
    Frame actual = expected;
    actual.pixels[299 * 700 + 650] ^= 1;
    const app::CheckRow row = row_of("cpu", 0, "ao", expected, actual);
    const app::RowImages images = app::images_of(4, row, expected, actual);
    EXPECT_EQ(images.row, 4u);
    EXPECT_EQ(images.width, 256u);
    EXPECT_EQ(images.height, 256u);
    EXPECT_EQ(images.left, 700u - 256);
    EXPECT_EQ(images.top, 300u - 256);
}

TEST(CrosscheckPage, HasEachSceneOfSeveral) {
    app::CheckRun run = planted_run(1, 1, 16, "builtin:one");
    app::CheckRun other = planted_run(1, 0, 16, "builtin:two");
    run.scenes.push_back(other.scenes[0]);
    const std::string page = page_of(run);
    EXPECT_NE(page.find("3 of 12 images differ"), std::string::npos);
    EXPECT_NE(page.find("<h2 id=\"scene-1\">builtin:one</h2>"), std::string::npos);
    EXPECT_NE(page.find("<h2 id=\"scene-2\">builtin:two</h2>"), std::string::npos);
    EXPECT_NE(page.find("morphray probe builtin:two "), std::string::npos);
    EXPECT_EQ(page.find("morphray probe builtin:one "), std::string::npos);
    ASSERT_EQ(embedded(page)["scenes"].size(), 2u);
    EXPECT_EQ(embedded(page)["scenes"][1]["scene"], "builtin:two");
}

TEST(CrosscheckPage, IsShownByABrowser) {
    if (run_shell("command -v chromium").status != 0)
        GTEST_SKIP() << "chromium is not installed: sudo apt-get install chromium";
    const TemporaryFolder folder;
    folder.write("page.html", page_of(planted_run(2, 1, 16)));
    const std::string dom =
        run_shell("cd " + shell_quoted(folder.path().string()) +
                  " && HOME=$PWD timeout 120 chromium --headless --no-sandbox --disable-gpu "
                  "--disable-dev-shm-usage --dump-dom page.html 2>/dev/null")
            .text;
    EXPECT_NE(dom.find("3 of 12 images differ"), std::string::npos) << dom;
    EXPECT_EQ(count(dom, "<img "), 9u);
}

}  // namespace
}  // namespace mray::test
