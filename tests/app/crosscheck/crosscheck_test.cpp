// Cross-checks of scenes whose images are equal, and the reports about them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Outcome crosscheck(Words more) {
    Words all = {"crosscheck", "builtin:cloth:400", "--backend", "cpu", "--size", "24x24"};
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
}

TEST(Crosscheck, EqualImagesGiveZero) {
    const Outcome outcome = crosscheck({});
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_TRUE(lines(outcome.out).back().starts_with("equal: ")) << outcome.out;
    EXPECT_TRUE(outcome.out.ends_with(" comparisons of 1 scene\n")) << outcome.out;
}

TEST(Crosscheck, ComparesAllWholeFramesOnRequest) {
    const Outcome outcome =
        crosscheck({"--frames", "all", "--rays", "primary", "--simd", "off", "--json", "-"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
    std::set<double> frames;
    for (const Json& row : json["scenes"][0]["rows"]) frames.insert(row["frame"].get<double>());
    EXPECT_EQ(frames.size(), 25u);
    EXPECT_EQ(*frames.rbegin(), 24);
}

TEST(Crosscheck, AnswersToQueriesAreCompared) {
    for (const char* reference : {"brute", "cpu"}) {
        TemporaryFolder folder;
        const Outcome outcome =
            crosscheck({"--frames", "0..24:12", "--rays", "primary", "--queries", "60",
                        "--reference", reference, "--json", "-"});
        ASSERT_EQ(outcome.code, 0) << outcome.out << outcome.err;
        const Json json = Json::parse(outcome.out);
        // As many variants as of images.
        EXPECT_EQ(json["scenes"][0]["queries"].size(), json["scenes"][0]["rows"].size());
        for (const Json& row : json["scenes"][0]["queries"]) {
            EXPECT_EQ(row["equal"], true);
            EXPECT_EQ(row["count"], 60);
            EXPECT_EQ(row["reference"], reference);
        }
    }
}

TEST(Crosscheck, JsonNamesEveryVariant) {
    const Outcome outcome = crosscheck({"--json", "-", "--frames", "0..24:12", "--simd", "off"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
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
    const Outcome outcome = crosscheck({"--json", "-", "--frames", "12", "--rays", "ao"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Json json = Json::parse(outcome.out);
    std::set<std::string> variants;
    for (const Json& row : json["scenes"][0]["rows"]) {
        EXPECT_EQ(row["equal"], true) << row;
        variants.insert(row["variant"]);
        if (row["simd"] != "") {
            EXPECT_NE(listed.find(row["simd"].get<std::string>()), std::string::npos) << row;
        }
    }
    EXPECT_TRUE(variants.contains("cpu, rebuild"));
    EXPECT_TRUE(variants.contains("cpu scalar, refit on cpu"));
    EXPECT_TRUE(variants.contains("cpu scalar, rebuild"));
    const auto commas = std::count(listed.begin(), listed.begin() + listed.find('\n'), ',');
    EXPECT_EQ(variants.size(), 2u + 2u * (static_cast<std::size_t>(commas) + 1));
}

TEST(Crosscheck, OneInstructionSetCanBeChosen) {
    const Outcome outcome =
        crosscheck({"--json", "-", "--frames", "3", "--rays", "shadow", "--simd", "scalar"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(Json::parse(outcome.out)["scenes"][0]["rows"].size(), 4u);
}

TEST(Crosscheck, RaysRestrictTheRows) {
    const Outcome outcome =
        crosscheck({"--json", "-", "--frames", "3", "--rays", "shadow", "--simd", "off"});
    const Json json = Json::parse(outcome.out);
    ASSERT_EQ(json["scenes"][0]["rows"].size(), 2u);
    EXPECT_EQ(json["scenes"][0]["rows"][0]["rays"], "shadow");
}

TEST(Crosscheck, ReferenceCanBeChosen) {
    const Outcome outcome =
        crosscheck({"--json", "-", "--frames", "3", "--reference", "cpu", "--simd", "off"});
    const Json json = Json::parse(outcome.out);
    // The CPU over the rebuilt tree is the reference, so only the refitted one is a variant.
    ASSERT_EQ(json["scenes"][0]["rows"].size(), 3u);
    EXPECT_EQ(json["scenes"][0]["rows"][0]["reference"], "cpu");
    EXPECT_EQ(json["scenes"][0]["rows"][0]["variant"], "cpu, refit on cpu");
}

TEST(Crosscheck, JunitEscapesNames) {
    TemporaryFolder folder;
    folder.write("a <&\" scene/f_0.obj", square_at(0));
    folder.write("a <&\" scene/f_1.obj", square_at(3));
    const std::string junit = folder.file("report.xml");
    const Outcome outcome = run({"crosscheck", folder.file("a <&\" scene"), "--backend", "cpu",
                                 "--simd", "off", "--size", "16x16", "--junit", junit, "-q"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const std::string xml = read_file(junit);
    EXPECT_NE(xml.find("a &lt;&amp;&quot; scene"), std::string::npos) << xml;
    EXPECT_NE(xml.find("tests=\"12\" failures=\"0\""), std::string::npos) << xml;
}

TEST(Crosscheck, BadFrameInTheMiddleKeepsTheReportOfTheEarlierOnes) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 1 3 4\n");
    const Outcome outcome = run({"crosscheck", folder.file("s"), "--backend", "cpu", "--simd",
                                 "off", "--size", "16x16", "--json", "-"});
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["complete"], false);
    EXPECT_EQ(json["scenes"][0]["rows"].size(), 6u);
}

TEST(Crosscheck, ACameraThatSeesNothingFails) {
    const Words away = {"--frames", "0",        "--simd",  "off",    "--eye",
                        "0,50,0",   "--target", "1,100,0", "--json", "-"};
    const Outcome outcome = crosscheck(away);
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("no camera ray hits anything"), std::string::npos) << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["equal"], false);
    EXPECT_EQ(json["complete"], false);
    EXPECT_EQ(json["scenes"][0]["equal"], false);
    EXPECT_EQ(json["scenes"][0]["rows"][0]["hits"], 0);
    // Queries do not depend on the camera.
    Words with_queries = away;
    with_queries.insert(with_queries.end(), {"--queries", "10"});
    EXPECT_EQ(crosscheck(with_queries).code, 0);
}

TEST(Crosscheck, NothingComparedIsNotEqual) {
    const Outcome outcome = run({"crosscheck", "none.obj", "--backend", "cpu", "--json", "-"});
    EXPECT_EQ(outcome.code, 3) << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["equal"], false);
    EXPECT_EQ(json["scenes"][0]["equal"], false);
}

TEST(Crosscheck, FilesOfAPatternWithoutQuotesAreWarnedOf) {
    TemporaryFolder folder;
    const auto check = [&](const Words& scenes) {
        Words words = {"crosscheck", "--backend", "cpu",    "--simd", "off",
                       "--size",     "8x8",       "--json", "-"};
        words.insert(words.end(), scenes.begin(), scenes.end());
        const Outcome outcome = run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return Json::parse(outcome.out)["scenes"][0]["warnings"];
    };
    const std::string first = folder.write("wave_001.obj", square_at(0));
    const std::string second = folder.write("wave_002.obj", square_at(1));
    const std::string other = folder.write("v2/wave_001.obj", square_at(1));
    const Json warnings = check({first, second, other});
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].get<std::string>().find("wave_*.obj: warning: 2 files"),
              std::string::npos)
        << warnings;
    EXPECT_TRUE(check({first, other}).empty());
}

TEST(Crosscheck, JunitTellsScenesOfOneNameApart) {
    const Outcome outcome = run({"crosscheck", "builtin:cloth:200", "builtin:cloth:300",
                                 "builtin:cloth:200", "--backend", "cpu", "--simd", "off", "--size",
                                 "8x8", "--frames", "0", "--junit", "-"});
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
        run({"crosscheck", "builtin:cloth:200", "builtin:twist:200", "--backend", "cpu", "--simd",
             "off", "--size", "8x8", "--frames", "30"});
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    ASSERT_EQ(lines(outcome.err).size(), 2u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("morphray: builtin:cloth:200: --frames: frame 30 is not"))
        << outcome.err;
    EXPECT_TRUE(lines(outcome.err)[1].starts_with("morphray: builtin:twist:200: "));
}

TEST(Crosscheck, DoesNotAcceptBruteAsABackend) {
    EXPECT_EQ(run({"crosscheck", "builtin:cloth:400", "--backend", "brute"}).code, 2);
}

}  // namespace
}  // namespace mray::test
