// profile --baseline: planted changes of an earlier report, and reports that cannot be compared. No
// test depends on a time: planted ones are a million times off, and a busy machine explains a
// factor of ten thousand at most.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

std::vector<std::string> profile(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"profile",   "builtin:cloth:20000",
                                          "--backend", "cpu",
                                          "--threads", "1",
                                          "--size",    "96x96",
                                          "--frames",  "0..12:6",
                                          "--repeat",  "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

/// A report of this machine.
const Json& report() {
    static const Json json = Json::parse(run(profile({"--json", "-"})).out);
    return json;
}

void scale(Json& number, double factor) { number = number.get<double>() * factor; }

/// All times of a stage of a frame `factor` times as long.
void scale_stage(Json& frame, const std::string& stage, double factor) {
    scale(frame["least_ms"][stage], factor);
    for (Json& ms : frame["samples_ms"][stage]) scale(ms, factor);
}

/// The report with all stages `factor` times as long, relative to its yardstick.
Json scaled(double factor, const Json& from = report()) {
    Json json = from;
    for (Json& frame : json["frames"]) {
        for (const char* stage : {"update", "rebuild", "trace", "trace_rebuilt"})
            scale_stage(frame, stage, factor);
    }
    return json;
}

void scale_yardstick(Json& json, double factor) {
    for (Json& frame : json["frames"]) {
        scale(frame["yardstick_ms"], factor);
        for (Json& ms : frame["samples_ms"]["yardstick"]) scale(ms, factor);
    }
}

/// The report as earlier versions wrote it.
Json without_samples(Json json) {
    json.erase("waited");
    json.erase("others");
    for (Json& frame : json["frames"]) {
        for (const char* name : {"samples_ms", "spread_percent"}) frame.erase(name);
        for (const char* name : {"deform", "upload", "refit", "yardstick"})
            frame["least_ms"].erase(name);
    }
    return json;
}

class Baseline : public testing::Test {
protected:
    Outcome compare(const std::string& text, const std::vector<std::string>& more = {}) {
        folder_.write("b.json", text);
        std::vector<std::string> arguments = profile({"--baseline", file()});
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    }
    Outcome compare(const Json& json, const std::vector<std::string>& more = {}) {
        return compare(json.dump(2), more);
    }
    std::string file() const { return folder_.file("b.json"); }

    void expect_refused(const Outcome& outcome, const std::string& why) {
        EXPECT_EQ(outcome.code, 3) << why;
        EXPECT_TRUE(outcome.err.starts_with(file() + ":")) << outcome.err;
        EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
        EXPECT_TRUE(outcome.out.empty()) << outcome.out;
    }

private:
    TemporaryFolder folder_;
};

TEST_F(Baseline, StagesThatBecameSlowerFailWithTheirNames) {
    const Outcome outcome = compare(scaled(1e-6));
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    for (const char* part : {"rebuild", "trace, rebuilt", "slower"})
        EXPECT_NE(outcome.out.find(part), std::string::npos) << part << '\n' << outcome.out;
    // The update of this mesh may be too short to be compared.
    EXPECT_TRUE(outcome.out.find("\n3 of 4 stages") != std::string::npos ||
                outcome.out.find("\n4 of 4 stages") != std::string::npos)
        << outcome.out;
    EXPECT_NE(outcome.out.find("than in " + file() + " (morphray "), std::string::npos)
        << outcome.out;
}

TEST_F(Baseline, StagesThatBecameFasterPass) {
    const Outcome outcome = compare(scaled(1e6));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("faster"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("none of 4 stages more than 5% slower"), std::string::npos)
        << outcome.out;
}

TEST_F(Baseline, TimesAreComparedInUnitsOfTheYardstick) {
    // A machine a million times as fast took a millionth of the time for everything, and its
    // yardstick less than that.
    Json fast = scaled(1e-6);
    scale_yardstick(fast, 1e-12);
    EXPECT_EQ(compare(fast).code, 0);
    // One with the same times and a millionth of the yardstick's speed was slow.
    Json slow = report();
    scale_yardstick(slow, 1e6);
    EXPECT_EQ(compare(slow).code, 1);
}

TEST_F(Baseline, OneFrameIsNotARegressionButIsShown) {
    Json json = scaled(1e6);
    scale_stage(json["frames"][1], "trace", 1e-12);
    const Outcome outcome = compare(json, {"--json", "-"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const Json trace = Json::parse(outcome.out)["baseline"]["stages"][2];
    EXPECT_EQ(trace["stage"], "trace");
    EXPECT_NE(trace["verdict"], "slower");
    EXPECT_EQ(trace["worst_frame"], 6);
    EXPECT_GT(trace["worst_percent"], 1000);
}

TEST_F(Baseline, JsonHasTheComparisonAndIsABaselineItself) {
    const Outcome outcome = compare(scaled(1e-6), {"--json", "-", "--tolerance", "25%"});
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["baseline"]["tolerance_percent"], 25);
    EXPECT_GE(json["baseline"]["slower"], 3);
    EXPECT_EQ(json["baseline"]["stages"].size(), 4u);
    for (const Json& stage : json["baseline"]["stages"]) {
        EXPECT_LE(stage["least_percent"], stage["percent"]);
        EXPECT_LE(stage["percent"], stage["most_percent"]);
        EXPECT_LE(stage["chance"], 1);
    }
    EXPECT_EQ(compare(scaled(1e6, json)).code, 0);
}

TEST_F(Baseline, ReportsOfEarlierVersionsHaveTheNoiseOfThisRun) {
    const Outcome slower = compare(without_samples(scaled(1e-6)));
    EXPECT_EQ(slower.code, 1) << slower.err;
    EXPECT_NE(slower.out.find("the baseline has no samples"), std::string::npos) << slower.out;
    const Outcome faster = compare(without_samples(scaled(1e6)), {"--json", "-"});
    EXPECT_EQ(faster.code, 0) << faster.err;
    EXPECT_EQ(Json::parse(faster.out)["baseline"]["has_samples"], false);
}

TEST_F(Baseline, OneRunTellsNothing) {
    Json json = report();
    for (Json& frame : json["frames"]) {
        for (Json& samples : frame["samples_ms"]) samples = Json::array({samples[0]});
    }
    // Three frames with one run there and three here: a chance of 1 in 4 each.
    const Outcome outcome = compare(scaled(1e-6, json));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(
        outcome.out.find("\n--repeat 1 of the baseline is too few to call a stage slower; 3 or "
                         "more are needed\n"),
        std::string::npos)
        << outcome.out;
}

TEST_F(Baseline, AToleranceThatIsLargeEnoughPasses) {
    EXPECT_EQ(compare(scaled(1e-6), {"--tolerance", "1e9"}).code, 0);
}

TEST_F(Baseline, OtherScenesAndOptionsAreRefusedByTheirDifference) {
    for (const auto& [pointer, value, why] :
         std::vector<std::tuple<std::string, Json, std::string>>{
             {"/scene", "wave", "scenes differ: wave there, cloth here"},
             {"/triangles", 7, "numbers of triangles differ: 7 there"},
             {"/width", 64, "sizes differ: 64x96 there, 96x96 here"},
             {"/rays", "ao", "kinds of rays differ: ao there, primary here"},
             {"/options", "--threads 2", "options differ: --threads 2 there, --threads 1 here"},
             {"/yardstick", "others", "yardsticks differ: others there"},
             {"/frames/1/frame", 7, "has no frame 6 on cpu"},
             {"/frames/2/backend", "vulkan", "has no frame 12 on cpu"}}) {
        Json json = report();
        json[Json::json_pointer(pointer)] = value;
        expect_refused(compare(json), why);
    }
    Json more = report();
    more["frames"].push_back(more["frames"][0]);
    more["frames"][3]["backend"] = "vulkan";
    expect_refused(compare(more), "has times of vulkan, which this run has not");
    more["frames"][3]["backend"] = "cpu";
    more["frames"][3]["frame"] = 3;
    expect_refused(compare(more), "has frame 3, which this run has not");
}

TEST_F(Baseline, FilesThatAreNoReportsAreRefused) {
    const std::string text = report().dump(2);
    for (const std::size_t length :
         {std::size_t{0}, std::size_t{1}, text.size() / 2, text.size() - 1})
        expect_refused(compare(text.substr(0, length)), "is not JSON");
    for (const char* json : {"1", "[]", "{}", "null"}) {
        expect_refused(compare(std::string(json)), "lacks the member schema");
    }
    for (const auto& [pointer, value, why] :
         std::vector<std::tuple<std::string, Json, std::string>>{
             {"/schema", "morphray/2", "has the schema morphray/2, not morphray/1"},
             {"/command", "render", "is another report"},
             {"/complete", false, "cut short"},
             {"/triangles", -1, "a triangles that is not a count"},
             {"/frames/0/yardstick_ms", 0, "yardstick_ms that is not above 0"},
             {"/frames/0/yardstick_ms", nullptr, "yardstick_ms that is not a number"},
             {"/frames/0/least_ms/trace", -1, "a trace below 0"},
             {"/frames/0/least_ms", 4, "lacks the member update"},
             {"/frames/0/samples_ms", 4, "lacks the member deform"},
             {"/frames/0/samples_ms/trace", 4, "has samples_ms of trace that are not a list"},
             {"/frames/0/samples_ms/trace", Json::array(), "has samples_ms of trace that are not"},
             {"/frames/0/samples_ms/trace/1", -1, "a sample of trace that is not a time"},
             {"/frames/0/samples_ms/trace/1", "1", "a sample of trace that is not a time"},
             {"/frames/0/samples_ms/yardstick/1", 0, "yardstick_ms that is not above 0"},
             {"/waited", 2, "has a part waited that is not from 0 to 1"},
             {"/others", -1, "has a part others that is not from 0 to 1"},
             {"/frames", 4, "lacks the member frame"}}) {
        Json json = report();
        json[Json::json_pointer(pointer)] = value;
        expect_refused(compare(json), why);
    }
    for (const char* name :
         {"version", "scene", "vertices", "height", "rays", "options", "others", "frames"}) {
        Json json = report();
        json.erase(name);
        expect_refused(compare(json), std::string("lacks the member ") + name);
    }
    Json old = report();
    old.erase("yardstick");
    expect_refused(compare(old), "has no yardstick; measure the baseline again");
}

TEST_F(Baseline, AMissingFileAndOptionsWithoutEffectAreRefused) {
    EXPECT_EQ(run(profile({"--baseline", file()})).code, 3);
    EXPECT_EQ(run(profile({"--tolerance", "5"})).code, 2);
    EXPECT_EQ(run(profile({"--baseline", file(), "--policies", "auto"})).code, 2);
    for (const char* value : {"-1", "nan", "ten", "%", "inf"})
        EXPECT_EQ(run(profile({"--baseline", file(), "--tolerance", value})).code, 2) << value;
}

TEST_F(Baseline, TablesFitAHundredColumns) {
    for (const Outcome& outcome :
         {compare(scaled(1e-9)), compare(scaled(1e12)),
          run({"profile", "builtin:orbits:2000", "--policies", "refit,rebuild,auto,every:16",
               "--backend", "cpu", "--size", "48x48", "--frames", "0..8", "--repeat", "1"})}) {
        for (const std::string& line : lines(outcome.out)) {
            if (line.find(file()) != std::string::npos) continue;
            EXPECT_LE(line.size(), 100u) << line;
        }
    }
}

}  // namespace
}  // namespace mray::test
