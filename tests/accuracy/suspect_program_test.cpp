// morphray crosscheck --suspect, as users start it.
#include <gtest/gtest.h>

#include <string>

#include "common/base/errors.h"
#include "gpu/ray_query/ray_query.h"
#include "tests/app/program.h"
#include "tests/support/temporary_folder.h"

namespace mray::test {
namespace {

bool device_has_rays() {
    try {
        gpu::make_ray_query();
        return true;
    } catch (const Error&) {
        return false;
    }
}

TEST(SuspectCommand, RefusesWhatItHasNoUseFor) {
    const auto refusal = [](std::vector<std::string> more) {
        more.insert(more.begin(), {"crosscheck", "failures:sphere"});
        const Outcome outcome = run(more);
        EXPECT_EQ(outcome.code, 2) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        return outcome.err;
    };
    EXPECT_NE(refusal({"--suspect", "rays"}).find("neither ray-query nor"), std::string::npos);
    EXPECT_NE(refusal({"--suspect", "ray-query:"}).find("neither ray-query nor"),
              std::string::npos);
    EXPECT_NE(refusal({"--suspect", "ray-query", "--bless", "a.json"}).find("--bless: "),
              std::string::npos);
    EXPECT_NE(refusal({"--hits", "a.hits"}).find("--hits: only --suspect"), std::string::npos);
}

TEST(SuspectCommand, JudgesTheDeviceOrSaysInOneLineWhyNot) {
    const TemporaryFolder folder;
    const auto path = [&](const char* name) { return (folder.path() / name).string(); };
    const std::vector<std::string> line = {"crosscheck",
                                           "failures:T-joints",
                                           "builtin:cloth:500",
                                           "--suspect",
                                           "ray-query",
                                           "--size",
                                           "64x64",
                                           "--frames",
                                           "0,8",
                                           "--json",
                                           path("a.json"),
                                           "--html",
                                           path("a.html"),
                                           "--hits",
                                           path("a.hits"),
                                           "--out",
                                           path("out")};
    const Outcome outcome = run(line);
    if (!device_has_rays()) {
        EXPECT_EQ(outcome.code, 4) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_NE(outcome.err.find("lacks VK_KHR_"), std::string::npos) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(path("a.json")));
        return;
    }
    EXPECT_LE(outcome.code, 1) << outcome.err;
    EXPECT_NE(outcome.out.find("driver: "), std::string::npos) << outcome.out;
    EXPECT_TRUE(std::filesystem::exists(path("a.html")));
    // 2 scenes of 2 frames, of which the second is updated and rebuilt, 2 sets of rays each.
    EXPECT_NE(outcome.out.find("updated"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.out.find("rebuilt"), std::string::npos) << outcome.out;
    // The same run again has the same hits.
    std::vector<std::string> again = line;
    again[14] = path("b.hits");
    EXPECT_EQ(run(again).code, outcome.code);
    const Outcome same = run({"diff", path("a.hits"), path("b.hits")});
    EXPECT_EQ(same.code, 0) << same.out << same.err;
}

TEST(DriverProfile, HasARowForEachStageOrSaysWhyNot) {
    const Outcome outcome =
        run({"profile", "builtin:cloth:500", "--backend", "ray-query", "--size", "32x32",
             "--ao-samples", "1", "--frames", "0,4", "--repeat", "1", "--json", "-"});
    if (!device_has_rays()) {
        EXPECT_EQ(outcome.code, 4) << outcome.err;
        EXPECT_NE(outcome.err.find("lacks VK_KHR_"), std::string::npos) << outcome.err;
        return;
    }
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    for (const char* const stage : {"build", "update", "rebuild", "camera rays, packets",
                                    "camera rays, single", "shadow rays", "ambient occlusion"}) {
        const std::string row = std::string("\"stage\": \"") + stage + "\"";
        EXPECT_NE(outcome.out.find(row), std::string::npos) << stage;
    }
}

TEST(DriverProfile, RefusesWhatItHasNoUseFor) {
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"--policies", "refit"}, {"--simd", "off"}, {"--rays", "ao"}}) {
        std::vector<std::string> line = {"profile", "builtin:cloth:500", "--backend", "ray-query"};
        line.insert(line.end(), more.begin(), more.end());
        const Outcome outcome = run(line);
        EXPECT_EQ(outcome.code, 2) << outcome.err;
        EXPECT_EQ(outcome.err.find("morphray: " + more.front() + ": "), 0u) << outcome.err;
    }
}

TEST(SuspectCommand, NamesTheMeshesThatThereAre) {
    if (!device_has_rays()) return;
    const Outcome outcome = run({"crosscheck", "--suspect", "ray-query", "failures:cube"});
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("T-joints"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace mray::test
