#include "lab/bench/options.h"

#include <gtest/gtest.h>

namespace mray::bench {
namespace {

BenchOptions parsed;

/// The exit code; the options are in `parsed`.
int parse(std::vector<const char*> arguments, BenchProgram program = BenchProgram::kRun) {
    arguments.insert(arguments.begin(), "program");
    return bench_main(program, static_cast<int>(arguments.size()), arguments.data(),
                      [](const BenchOptions& options) {
                          parsed = options;
                          return 0;
                      });
}

TEST(BenchOptions, TakesBuiltInScenesIfNoneIsGiven) {
    EXPECT_EQ(parse({}), 0);
    EXPECT_EQ(parsed.scenes.size(), 4u);
    EXPECT_EQ(parse({"a.obj", "b.obj"}), 0);
    EXPECT_EQ(parsed.scenes, (std::vector<std::string>{"a.obj", "b.obj"}));
}

TEST(BenchOptions, ReadsLists) {
    EXPECT_EQ(parse({"--threads", "1,3", "--work", "ao,build"}), 0);
    EXPECT_EQ(parsed.threads, (std::vector<int>{1, 3}));
    EXPECT_EQ(parsed.works, (std::vector<std::string>{"ao", "build"}));
}

TEST(BenchOptions, TakesTwoBuildsAndTracedWorks) {
    const BenchProgram builds = BenchProgram::kBuilds;
    EXPECT_EQ(parse({"a.so", "b.so", "--work", "ao", "--simd", "avx2", "x.obj"}, builds), 0);
    EXPECT_EQ(parsed.other_build, "b.so");
    EXPECT_EQ(parsed.scenes, std::vector<std::string>{"x.obj"});
    EXPECT_EQ(parsed.simd, std::vector<std::string>{"avx2"});
    EXPECT_EQ(parse({"a.so"}, builds), 2);
    EXPECT_EQ(parse({"a.so", "b.so", "--work", "build"}, builds), 2);
}

TEST(BenchOptions, RefusesSizesThatAreNotMultiplesOfATile) {
    EXPECT_EQ(parse({"--size", "64"}), 0);
    EXPECT_EQ(parsed.view.height, 64u);
    EXPECT_EQ(parse({"--size", "65"}), 2);
}

}  // namespace
}  // namespace mray::bench
