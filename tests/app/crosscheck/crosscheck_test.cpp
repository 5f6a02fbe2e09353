// Cross-checks of scenes whose images are equal, and reports, also of those that end early.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <set>
#include <thread>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

Outcome crosscheck(const std::string& more) {
    return run(words("crosscheck builtin:cloth:400 --backend cpu --size 24x24 " + more));
}

TEST(Crosscheck, ComparesAllWholeFramesOnRequest) {
    const Json json = json_of(crosscheck("--frames all --rays primary --simd off --json -"));
    std::set<double> frames;
    for (const Json& row : json["scenes"][0]["rows"]) frames.insert(row["frame"].get<double>());
    EXPECT_EQ(frames.size(), 25u);
    EXPECT_EQ(*frames.rbegin(), 24);
}

TEST(Crosscheck, AnswersToQueriesAreCompared) {
    for (const char* reference : {"brute", "cpu"}) {
        const Json json = json_of(
            crosscheck("--frames 0..24:12 --rays primary --queries 60 --json - --reference " +
                       std::string(reference)));
        // As many variants as of images.
        EXPECT_EQ(json["scenes"][0]["queries"].size(), json["scenes"][0]["rows"].size());
        // Over a rebuilt tree the reference is no variant.
        for (const Json& row : json["scenes"][0]["rows"]) {
            EXPECT_EQ(row["reference"], reference);
            EXPECT_NE(row["variant"], reference + std::string(", rebuild"));
        }
        for (const Json& row : json["scenes"][0]["queries"]) {
            EXPECT_EQ(row["equal"], true);
            EXPECT_EQ(row["count"], 60);
            EXPECT_EQ(row["reference"], reference);
        }
    }
}

TEST(Crosscheck, DigestsOfAllInstructionSetsAreTheDocumentedOne) {
    const Outcome outcome = run(words("crosscheck --digest --backend cpu"));
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
    const Words table = lines(outcome.out);
    // An instruction set, none; then an empty line and the verdict.
    ASSERT_GE(table.size(), 4u);
    EXPECT_EQ(table.back(), "equal: all digests are the documented one");
    for (std::size_t i = 0; i + 2 < table.size(); ++i)
        EXPECT_EQ(table[i].substr(0, 16), table[0].substr(0, 16)) << table[i];
    EXPECT_TRUE(has(table[table.size() - 3], "cpu: portable C++"));
}

TEST(Crosscheck, JsonNamesEveryVariant) {
    const Json json = json_of(crosscheck("--json - --frames 0..24:12 --simd off"));
    EXPECT_EQ(json["schema"], "morphray/1");
    EXPECT_EQ(json["command"], "crosscheck");
    EXPECT_EQ(json["equal"], true);
    EXPECT_EQ(json["complete"], true);
    // Refitted and rebuilt, three kinds of rays, three frames.
    ASSERT_EQ(json["scenes"][0]["rows"].size(), 18u);
    for (const Json& row : json["scenes"][0]["rows"]) {
        EXPECT_EQ(row.at("equal"), true);
        EXPECT_EQ(row.at("reference"), "brute");
        EXPECT_EQ(row.at("hits_hash"), row.at("expected_hits_hash"));
        EXPECT_EQ(row.at("image_hash"), row.at("expected_image_hash"));
        EXPECT_EQ(row.at("differences").at("total"), 0);
        EXPECT_TRUE(row.at("variant") == "cpu, refit on cpu" || row.at("variant") == "cpu, rebuild")
            << row;
    }
}

TEST(Crosscheck, EveryInstructionSetIsAVariantOverBothTrees) {
    const Outcome info = run({"info"});
    const std::string listed = info.out.substr(info.out.find("cpu: "));
    const Json json = json_of(crosscheck("--json - --frames 12 --rays ao"));
    std::set<std::string> variants;
    for (const Json& row : json["scenes"][0]["rows"]) {
        EXPECT_EQ(row["equal"], true) << row;
        variants.insert(row["variant"]);
        if (row["simd"] != "") {
            EXPECT_TRUE(has(listed, row["simd"].get<std::string>())) << row;
        }
    }
    EXPECT_TRUE(variants.contains("cpu, rebuild"));
    EXPECT_TRUE(variants.contains("cpu scalar, refit on cpu"));
    EXPECT_TRUE(variants.contains("cpu scalar, rebuild"));
    const auto commas = std::count(listed.begin(), listed.begin() + listed.find('\n'), ',');
    EXPECT_EQ(variants.size(), 2u + 2u * (static_cast<std::size_t>(commas) + 1));
}

TEST(Crosscheck, OneInstructionSetCanBeChosen) {
    const Json rows =
        json_of(crosscheck("--json - --frames 3 --rays shadow --simd scalar"))["scenes"][0]["rows"];
    EXPECT_EQ(rows.size(), 4u);
    EXPECT_EQ(rows[0]["rays"], "shadow");
    EXPECT_EQ(crosscheck("--frames 0 --simd off -q").out, "");
}

TEST(Crosscheck, ACameraThatSeesNothingFails) {
    const std::string away = "--frames 0 --simd off --eye 0,50,0 --target 1,100,0 --json -";
    const Outcome outcome = crosscheck(away);
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_TRUE(has(outcome.err, "no camera ray hits anything"));
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["equal"], false);
    EXPECT_EQ(json["complete"], false);
    EXPECT_EQ(json["scenes"][0]["equal"], false);
    EXPECT_EQ(json["scenes"][0]["rows"][0]["hits"], 0);
    // Queries do not depend on the camera.
    EXPECT_EQ(crosscheck(away + " --queries 10").code, 0);
}

TEST(Crosscheck, JunitTellsScenesOfOneNameApart) {
    const Outcome outcome =
        run(words("crosscheck builtin:cloth:200 builtin:cloth:300 builtin:cloth:200 --backend cpu "
                  "--simd off --size 8x8 --frames 0 --junit -"));
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    std::set<std::string> cases;
    std::size_t count = 0;
    for (const std::string& line : lines(outcome.out)) {
        if (line.find("<testcase") == std::string::npos) continue;
        cases.insert(line.substr(0, line.find(" time=")));
        ++count;
    }
    EXPECT_EQ(count, 18u);
    EXPECT_EQ(cases.size(), count) << outcome.out;
}

TEST(Crosscheck, AnErrorNamesItsScene) {
    const Outcome outcome =
        run(words("crosscheck builtin:cloth:200 builtin:twist:200 --backend cpu --simd off "
                  "--size 8x8 --frames 30"));
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    ASSERT_EQ(lines(outcome.err).size(), 2u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("morphray: builtin:cloth:200: --frames: frame 30 is not"))
        << outcome.err;
    EXPECT_TRUE(lines(outcome.err)[1].starts_with("morphray: builtin:twist:200: "));
}

/// The three reports in a folder.
struct Reports {
    Json json;
    std::string junit, html;
};

Words with_reports(const TemporaryFolder& folder, const std::string& scenes) {
    return words("crosscheck --backend cpu --simd off " + scenes,
                 {"--json", folder.file("r.json"), "--junit", folder.file("r.xml"), "--html",
                  folder.file("r.html")});
}

Reports reports_in(const TemporaryFolder& folder) {
    return {Json::parse(read_file(folder.file("r.json"))), read_file(folder.file("r.xml")),
            read_file(folder.file("r.html"))};
}

TEST(CrosscheckReports, AreWrittenWhenASignalEndsTheRun) {
    const TemporaryFolder folder;
    // Some images are compared in two seconds, on a busy machine, too; all take minutes.
    Started check(with_reports(
        folder,
        "builtin:cloth:4000 builtin:twist:400 --frames 0..24:0.03125 --reference brute --size "
        "32x32 --rays shadow"));
    std::this_thread::sleep_for(std::chrono::seconds(2));
    check.send(SIGTERM);
    const Outcome outcome = check.wait();
    EXPECT_EQ(outcome.code, 143) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    const Reports reports = reports_in(folder);
    const Json& json = reports.json;
    EXPECT_EQ(json["complete"], false);
    EXPECT_TRUE(has(json["error"].get<std::string>(), "terminated"));
    ASSERT_EQ(json["scenes"].size(), 2u);
    EXPECT_EQ(json["scenes"][1]["complete"], false);
    EXPECT_TRUE(has(reports.junit, "<error message=\"terminated"));
    EXPECT_TRUE(has(reports.html, "\"complete\":false"));
}

TEST(CrosscheckReports, AreWrittenWhenAFrameCannotBeRead) {
    const TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 1 3 4\n");
    const Outcome outcome = run(with_reports(folder, folder.file("s") + " --size 16x16"));
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    const Reports reports = reports_in(folder);
    EXPECT_EQ(reports.json["complete"], false);
    EXPECT_TRUE(has(reports.junit, "tests=\"7\" failures=\"0\" errors=\"1\""));
    EXPECT_TRUE(has(reports.html, "\"complete\":false"));
    EXPECT_EQ(lines(outcome.out).back(),
              "not finished: " + folder.file("s") + " could not be read");
}

TEST(CrosscheckReports, AreWrittenWhenTheSceneCannotBeOpened) {
    const TemporaryFolder folder;
    const Outcome outcome = run(with_reports(folder, folder.file("none.obj")));
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    const std::string verdict = "not finished: " + folder.file("none.obj") + " could not be read";
    EXPECT_EQ(outcome.out, verdict + "\n");
    const Reports reports = reports_in(folder);
    EXPECT_EQ(reports.json["verdict"], verdict);
    EXPECT_EQ(reports.json["equal"], false);
    EXPECT_EQ(reports.json["scenes"][0]["equal"], false);
    EXPECT_TRUE(has(reports.junit, "<testsuites name=\"" + verdict));
    EXPECT_TRUE(has(reports.junit, "tests=\"1\" failures=\"0\" errors=\"1\""));
    EXPECT_FALSE(reports.html.empty());
}

TEST(CrosscheckReports, OfSeveralScenesGoOnAfterOneThatCannotBeOpened) {
    const TemporaryFolder folder;
    const std::string none = folder.file("none.obj");
    const Outcome outcome = run(with_reports(
        folder, "builtin:cloth:200 " + none + " builtin:twist:200 --size 8x8 --frames 0"));
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with(none)) << outcome.err;
    const Reports reports = reports_in(folder);
    const Json& json = reports.json;
    EXPECT_EQ(json["equal"], true);
    EXPECT_EQ(json["complete"], false);
    EXPECT_EQ(lines(outcome.out).back(), "not finished: " + none + " could not be read");
    ASSERT_EQ(json["scenes"].size(), 3u);
    EXPECT_EQ(json["scenes"][0]["rows"].size(), 6u);
    EXPECT_NE(json["scenes"][1]["error"], "");
    EXPECT_EQ(json["scenes"][2]["rows"].size(), 6u);
    EXPECT_EQ(json["scenes"][2]["complete"], true);
    EXPECT_TRUE(has(outcome.out, "builtin:cloth:200\n\nvariant"));
    EXPECT_TRUE(has(outcome.out, "builtin:twist:200\n\nvariant"));
}

TEST(CrosscheckReports, NameTheirEnvironment) {
    const TemporaryFolder folder;
    const Outcome outcome = run(with_reports(folder, "builtin:cloth:200 --size 8x8 --frames 0"));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Reports reports = reports_in(folder);
    const Json& json = reports.json;
    EXPECT_EQ(json["scenes"][0]["rows"].size(), 6u);
    EXPECT_EQ(json["environment"]["devices"], Json::array());
    EXPECT_EQ(lines(outcome.out).back(), "equal: 6 comparisons of 1 scene");
    EXPECT_EQ(outcome.err, "");
    EXPECT_TRUE(has(reports.html, "\"equal\":true"));
}

}  // namespace
}  // namespace mray::test
