// profile --baseline: planted changes of an earlier report, and reports that cannot be compared. No
// test depends on a time: planted ones are a million times off.
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

/// The report with the times of a trace and of all other stages this many times as long.
Json scaled(double trace, double others) {
    Json json = report();
    for (Json& frame : json["frames"]) {
        for (const std::string stage : {"update", "rebuild", "trace", "trace_rebuilt"})
            for (Json& ms : frame["samples_ms"][stage])
                ms = ms.get<double>() * (stage == "trace" ? trace : others);
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
        return compare(json.dump(), more);
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

TEST_F(Baseline, AStageThatBecameSlowerFailsWithItsName) {
    const Outcome outcome = compare(scaled(1e-6, 1e6));
    EXPECT_EQ(outcome.code, 1) << outcome.err;
    const std::string last = lines(outcome.out).back();
    EXPECT_TRUE(last.starts_with("more than 5% slower than in " + file() + " (morphray ")) << last;
    EXPECT_TRUE(last.ends_with("): trace on cpu")) << last;
    EXPECT_EQ(outcome.err, "");
}

TEST_F(Baseline, TheVerdictIsOnStderrWhereTheTableIsNotShown) {
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"-q"}, std::vector<std::string>{"--json", "-"}}) {
        const Outcome outcome = compare(scaled(1e-6, 1e6), more);
        EXPECT_EQ(outcome.code, 1) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with("morphray: more than 5% slower")) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    }
    // A report that cannot be written does not hide that something is slower.
    EXPECT_EQ(compare(scaled(1e-6, 1e6), {"--json", "/dev/full"}).code, 1);
}

TEST_F(Baseline, StagesThatBecameFasterPass) {
    const Outcome outcome = compare(scaled(1e6, 1e6));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(outcome.out.ends_with("): none\n")) << outcome.out;
}

TEST_F(Baseline, AToleranceThatIsLargeEnoughPasses) {
    EXPECT_EQ(compare(scaled(1e-6, 1e-6), {"--tolerance", "25%"}).code, 1);
    EXPECT_EQ(compare(scaled(1e-6, 1e-6), {"--tolerance", "1e12"}).code, 0);
}

TEST_F(Baseline, OtherScenesFramesAndOptionsAreRefused) {
    for (const auto& [pointer, value, why] :
         std::vector<std::tuple<std::string, Json, std::string>>{
             {"/scene", "twist", "is of scene \"twist\""},
             {"/triangles", 7, "triangles 7"},
             {"/width", 64, "width 64"},
             {"/rays", "ao", "rays \"ao\""},
             {"/options", "--threads 2", "options \"--threads 2\""},
             {"/command", "render", "command \"render\""},
             {"/frames/1/frame", 7, "other frames or backends"},
             {"/frames/2/backend", "vulkan", "other frames or backends"},
             {"/frames/0/samples_ms/trace", Json::array({1}), "different numbers of runs"},
             {"/frames/0/samples_ms/trace/1", "1", "lacks a member"},
             {"/frames", 4, "lacks a member"}}) {
        Json json = report();
        json[Json::json_pointer(pointer)] = value;
        expect_refused(compare(json), why);
    }
    const std::string text = report().dump();
    expect_refused(compare(text.substr(0, text.size() / 2)), "is not JSON");
    expect_refused(compare(std::string("[]")), "lacks a member");
}

TEST_F(Baseline, AMissingFileAndOptionsWithoutEffectAreRefused) {
    EXPECT_EQ(run(profile({"--baseline", file()})).code, 3);
    EXPECT_EQ(run(profile({"--tolerance", "5"})).code, 2);
    EXPECT_EQ(run(profile({"--baseline", file(), "--policies", "auto"})).code, 2);
    for (const char* value : {"-1", "nan", "ten", "%", "inf"})
        EXPECT_EQ(run(profile({"--baseline", file(), "--tolerance", value})).code, 2) << value;
}

}  // namespace
}  // namespace mray::test
