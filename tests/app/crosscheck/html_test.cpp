// The page of a cross-check: what it holds, and that it needs nothing but itself.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "app/report/crosscheck/check_report.h"
#include "common/report/shell.h"
#include "tests/app/crosscheck/planted_checks.h"
#include "tests/support/temporary_folder.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
        ++found;
    return found;
}

Json embedded(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"report\">";
    const std::size_t from = page.find(begin) + begin.size();
    return Json::parse(page.substr(from, page.find("</script>", from) - from));
}

std::string page_of(const app::CheckRun& run) {
    app::CrosscheckOptions options;
    options.view.width = run.scenes[0].head.width;
    options.view.height = run.scenes[0].head.height;
    return app::to_html(options, run);
}

TEST(CrosscheckPage, HasTheJsonOfTheReport) {
    const app::CheckRun run = planted_run(2, 1, 16);
    Json json = embedded(page_of(run));
    json.erase("details");
    EXPECT_EQ(json, Json::parse(app::to_json(run)));
}

TEST(CrosscheckPage, EscapesWhatComesFromOutside) {
    const app::CheckRun run = planted_run(1, 0, 16);
    const std::string page = page_of(run);
    // The page itself has two, for data and script.
    EXPECT_EQ(count(page, "</script>"), 2u);
    EXPECT_EQ(embedded(page)["scenes"][0]["scene"], run.scenes[0].spec);
}

TEST(CrosscheckPage, NamesThePixelsAndCommandsOfEachImageThatDiffers) {
    app::CheckRun run = planted_run(3, 1, 16, "builtin:one");
    run.scenes.push_back(planted_run(1, 0, 16, "builtin:two").scenes[0]);
    const Json details = embedded(page_of(run))["details"];
    ASSERT_EQ(details.size(), 9u);
    EXPECT_EQ(details[0]["scene"], 0);
    EXPECT_EQ(details[0]["row"], 6);
    const std::string text = details[0]["text"];
    EXPECT_NE(text.find("frame 1, vulkan, refit on cpu, primary: 5 pixels"), std::string::npos);
    EXPECT_NE(text.find("0x1.800002p+0"), std::string::npos) << text;
    EXPECT_NE(text.find("morphray probe builtin:one --frame 1 --pixel 1,1 "), std::string::npos);
    EXPECT_EQ(details[8]["scene"], 1);
    EXPECT_NE(details[8]["text"].get<std::string>().find("probe builtin:two "), std::string::npos);
}

TEST(CrosscheckPage, DescribesAHundredImages) {
    const Json json = embedded(page_of(planted_run(84, 0, 16)));
    EXPECT_EQ(json["scenes"][0]["rows"].size(), 504u);
    EXPECT_EQ(json["details"].size(), 100u);
}

TEST(CrosscheckPage, LoadsNothing) {
    const std::string page = page_of(planted_run(2, 0, 16));
    for (const char* part :
         {"http://", "https://", "@import", "url(", "<link", "<iframe", "src=\""})
        EXPECT_EQ(page.find(part), std::string::npos) << part;
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
    EXPECT_NE(dom.find("Different: 3 of 14 comparisons differ"), std::string::npos) << dom;
    EXPECT_EQ(count(dom, "<td class=\"bad\">1 of 2 differ</td>"), 3u);
    EXPECT_EQ(count(dom, "<td class=\"good\">2 equal</td>"), 3u);
    EXPECT_EQ(count(dom, "<h3>frame 1, vulkan, refit on cpu"), 3u);
}

}  // namespace
}  // namespace mray::test
