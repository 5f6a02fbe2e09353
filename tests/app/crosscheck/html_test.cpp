// The page of a cross-check: what it holds, and that it needs nothing but itself.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "app/report/check_report.h"
#include "report/shell.h"
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

TEST(CrosscheckPage, HasTheJsonOfTheReport) {
    const app::Json run = planted_run(2, 1, 16);
    EXPECT_EQ(embedded(app::to_html(run)), Json::parse(app::json_text(run)));
}

TEST(CrosscheckPage, EscapesWhatComesFromOutside) {
    const app::Json run = planted_run(1, 0, 16);
    const std::string page = app::to_html(run);
    // The page itself has two, for data and script.
    EXPECT_EQ(count(page, "</script>"), 2u);
    EXPECT_EQ(embedded(page)["scenes"][0]["scene"], run["scenes"][0]["spec"]);
}

TEST(CrosscheckPage, NamesThePixelsAndCommandsOfEachImageThatDiffers) {
    const app::Json run = planted_run(3, 1, 16, "builtin:one");
    const Json rows = embedded(app::to_html(run))["scenes"][0]["rows"];
    std::size_t described = 0;
    for (const Json& row : rows) described += row.contains("details");
    EXPECT_EQ(described, 6u);
    EXPECT_TRUE(rows[6]["message"].get<std::string>().starts_with("5 pixels")) << rows[6];
    const std::string text = rows[6]["details"];
    EXPECT_NE(text.find("0x1.800002p+0"), std::string::npos) << text;
    const std::string command = "morphray probe builtin:one --frame 1 --pixel 1,1 ";
    EXPECT_NE(text.find(command), std::string::npos);
    EXPECT_NE(app::to_junit(run).find(command), std::string::npos);
}

TEST(CrosscheckPage, DescribesAHundredImages) {
    const Json rows = embedded(app::to_html(planted_run(84, 0, 16)))["scenes"][0]["rows"];
    EXPECT_EQ(rows.size(), 504u);
    std::size_t described = 0;
    for (const Json& row : rows) described += row.contains("details");
    EXPECT_EQ(described, 100u);
}

TEST(CrosscheckPage, LoadsNothing) {
    const std::string page = app::to_html(planted_run(2, 0, 16));
    for (const char* part :
         {"http://", "https://", "@import", "url(", "<link", "<iframe", "src=\""})
        EXPECT_EQ(page.find(part), std::string::npos) << part;
}

TEST(CrosscheckPage, IsShownByABrowser) {
    if (run_shell("command -v chromium").status != 0)
        GTEST_SKIP() << "chromium is not installed: sudo apt-get install chromium";
    const TemporaryFolder folder;
    folder.write("page.html", app::to_html(planted_run(2, 1, 16)));
    const std::string dom =
        run_shell("cd " + shell_quoted(folder.path().string()) +
                  " && HOME=$PWD timeout 120 chromium --headless --no-sandbox --disable-gpu "
                  "--disable-dev-shm-usage --dump-dom page.html 2>/dev/null")
            .text;
    EXPECT_NE(dom.find("different: 3 of 14, first in "), std::string::npos) << dom;
    EXPECT_EQ(count(dom, "<td class=\"bad\">3 of 6 differ</td>"), 1u);
    EXPECT_EQ(count(dom, "<td class=\"good\">6 equal</td>"), 1u);
    EXPECT_EQ(count(dom, "<td class=\"good\">2 equal</td>"), 1u);
    EXPECT_EQ(count(dom, "<h3 class=\"bad\">frame 1, vulkan, refit on cpu"), 3u);
}

}  // namespace
}  // namespace mray::test
