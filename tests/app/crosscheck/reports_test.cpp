// Reports of cross-checks of several scenes, with warnings, and of those that end early.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

/// The three reports in a folder.
struct Reports {
    std::string json, junit, html;
};

Words with_reports(const TemporaryFolder& folder, Words words) {
    words.insert(words.end(), {"--backend", "cpu", "--simd", "off", "--json", folder.file("r.json"),
                               "--junit", folder.file("r.xml"), "--html", folder.file("r.html")});
    return words;
}

Reports reports_in(const TemporaryFolder& folder) {
    return {read_file(folder.file("r.json")), read_file(folder.file("r.xml")),
            read_file(folder.file("r.html"))};
}

TEST(CrosscheckReports, AreWrittenWhenASignalEndsTheRun) {
    const TemporaryFolder folder;
    // Some images are compared in two seconds, on a busy machine, too; all take minutes.
    Started check(with_reports(
        folder, {"crosscheck", "builtin:cloth:4000", "builtin:twist:400", "--frames",
                 "0..24:0.03125", "--reference", "brute", "--size", "32x32", "--rays", "shadow"}));
    std::this_thread::sleep_for(std::chrono::seconds(2));
    check.send(SIGTERM);
    const Outcome outcome = check.wait();
    EXPECT_EQ(outcome.code, 143) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    const Reports reports = reports_in(folder);
    const Json json = Json::parse(reports.json);
    EXPECT_EQ(json["complete"], false);
    EXPECT_NE(json["error"].get<std::string>().find("terminated"), std::string::npos);
    ASSERT_EQ(json["scenes"].size(), 2u);
    EXPECT_EQ(json["scenes"][1]["complete"], false);
    EXPECT_NE(reports.junit.find("<error message=\"terminated"), std::string::npos);
    EXPECT_NE(reports.html.find("\"complete\":false"), std::string::npos);
}

TEST(CrosscheckReports, AreWrittenWhenAFrameCannotBeRead) {
    const TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 1 3 4\n");
    const Outcome outcome =
        run(with_reports(folder, {"crosscheck", folder.file("s"), "--size", "16x16"}));
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    const Reports reports = reports_in(folder);
    EXPECT_EQ(Json::parse(reports.json)["complete"], false);
    EXPECT_NE(reports.junit.find("tests=\"7\" failures=\"0\" errors=\"1\""), std::string::npos)
        << reports.junit;
    EXPECT_NE(reports.html.find("\"complete\":false"), std::string::npos);
    EXPECT_EQ(lines(outcome.out).back(),
              "not finished: " + folder.file("s") + " could not be read");
}

TEST(CrosscheckReports, AreWrittenWhenTheSceneCannotBeOpened) {
    const TemporaryFolder folder;
    const Outcome outcome = run(with_reports(folder, {"crosscheck", folder.file("none.obj")}));
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    const std::string verdict = "not finished: " + folder.file("none.obj") + " could not be read";
    EXPECT_EQ(outcome.out, verdict + "\n");
    const Reports reports = reports_in(folder);
    EXPECT_EQ(Json::parse(reports.json)["verdict"], verdict);
    EXPECT_NE(reports.junit.find("<testsuites name=\"" + verdict), std::string::npos);
    EXPECT_NE(reports.junit.find("tests=\"1\" failures=\"0\" errors=\"1\""), std::string::npos)
        << reports.junit;
    EXPECT_FALSE(reports.html.empty());
}

TEST(CrosscheckReports, OfSeveralScenesGoOnAfterOneThatCannotBeOpened) {
    const TemporaryFolder folder;
    const std::string none = folder.file("none.obj");
    const Outcome outcome =
        run(with_reports(folder, {"crosscheck", "builtin:cloth:200", none, "builtin:twist:200",
                                  "--size", "8x8", "--frames", "0"}));
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with(none)) << outcome.err;
    const Reports reports = reports_in(folder);
    const Json json = Json::parse(reports.json);
    EXPECT_EQ(json["equal"], true);
    EXPECT_EQ(json["complete"], false);
    EXPECT_EQ(lines(outcome.out).back(), "not finished: " + none + " could not be read");
    ASSERT_EQ(json["scenes"].size(), 3u);
    EXPECT_EQ(json["scenes"][0]["rows"].size(), 6u);
    EXPECT_NE(json["scenes"][1]["error"], "");
    EXPECT_EQ(json["scenes"][2]["rows"].size(), 6u);
    EXPECT_EQ(json["scenes"][2]["complete"], true);
    EXPECT_NE(outcome.out.find("builtin:cloth:200\n\nvariant"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("builtin:twist:200\n\nvariant"), std::string::npos) << outcome.out;
}

TEST(CrosscheckReports, NameTheirEnvironment) {
    const TemporaryFolder folder;
    const Outcome outcome = run(with_reports(
        folder, {"crosscheck", "builtin:cloth:200", "--size", "8x8", "--frames", "0"}));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Reports reports = reports_in(folder);
    const Json json = Json::parse(reports.json);
    EXPECT_EQ(json["scenes"][0]["rows"].size(), 6u);
    EXPECT_EQ(json["environment"]["devices"], Json::array());
    EXPECT_NE(reports.html.find("\"equal\":true"), std::string::npos);
}

}  // namespace
}  // namespace mray::test
