#include "lab/bench/options.h"

#include <gtest/gtest.h>

#include "common/base/errors.h"

namespace mray::bench {
namespace {

BenchOptions parse(const std::vector<std::string>& arguments) { return parse_options(arguments); }

std::string refusal_of(const std::vector<std::string>& arguments) {
    try {
        parse(arguments);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kBadArgument);
        return error.what();
    }
    return "none";
}

TEST(ParseOptions, AddsScenesToTheBuiltInOnes) {
    const std::size_t built_in = parse({}).scenes.size();
    EXPECT_EQ(parse({"a.obj"}).scenes.size(), built_in + 1);
    EXPECT_EQ(parse({"a.obj", "--only", "b.obj"}).scenes,
              (std::vector<std::string>{"a.obj", "b.obj"}));
    EXPECT_EQ(refusal_of({"--only"}), "--only: expected a SCENE");
}

TEST(ParseOptions, ReadsLists) {
    EXPECT_EQ(parse({"--threads", "1,3"}).threads, (std::vector<int>{1, 3}));
    EXPECT_EQ(parse({"--work", "ao,build"}).works, (std::vector<std::string>{"ao", "build"}));
    EXPECT_EQ(parse({"--ao-samples", "2,8"}).ao_samples, (std::vector<std::uint32_t>{2, 8}));
    EXPECT_EQ(parse({"--view", "whole"}).view_kind, ViewKind::kWhole);
}

}  // namespace
}  // namespace mray::bench
