#include "lab/bench/options.h"

#include <gtest/gtest.h>

#include "common/base/errors.h"

namespace mray::bench {
namespace {

BenchOptions parse(const std::vector<std::string>& arguments) { return parse_options(arguments); }

TEST(ParseOptions, TakesBuiltInScenesIfNoneIsGiven) {
    EXPECT_EQ(parse({}).scenes.size(), 4u);
    EXPECT_EQ(parse({"a.obj", "b.obj"}).scenes, (std::vector<std::string>{"a.obj", "b.obj"}));
}

TEST(ParseOptions, ReadsLists) {
    EXPECT_EQ(parse({"--threads", "1,3"}).threads, (std::vector<int>{1, 3}));
    EXPECT_EQ(parse({"--work", "ao,build"}).works, (std::vector<std::string>{"ao", "build"}));
}

TEST(ParseOptions, TakesTwoBuildsAndTracedWorks) {
    const auto builds = [](const std::vector<std::string>& arguments) {
        return parse_options(arguments, BenchProgram::kBuilds);
    };
    const BenchOptions options =
        builds({"a.so", "b.so", "--work", "ao", "--simd", "avx2", "x.obj"});
    EXPECT_EQ(options.other_build, "b.so");
    EXPECT_EQ(options.scenes, std::vector<std::string>{"x.obj"});
    EXPECT_EQ(options.simd, std::vector<std::string>{"avx2"});
    EXPECT_THROW(builds({"a.so"}), Error);
    EXPECT_THROW(builds({"a.so", "b.so", "--work", "build"}), Error);
}

TEST(ParseOptions, RefusesSizesThatAreNotMultiplesOfATile) {
    EXPECT_EQ(parse({"--size", "64"}).view.height, 64u);
    EXPECT_THROW(parse({"--size", "65"}), Error);
}

}  // namespace
}  // namespace mray::bench
