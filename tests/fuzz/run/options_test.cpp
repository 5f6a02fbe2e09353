#include "tests/fuzz/run/options.h"

#include <gtest/gtest.h>

#include "common/base/errors.h"

namespace mray::fuzz {
namespace {

std::optional<FuzzOptions> parse(const std::vector<std::string>& arguments) {
    return parse_fuzz_options(arguments);
}

TEST(FuzzOptions, AreRead) {
    const auto options = parse({"one-picture", "--hours", "0.5", "--seed", "7", "--backend", "all",
                                "--failures", "3", "--list", "--out", "elsewhere"});
    ASSERT_TRUE(options.has_value());
    EXPECT_EQ(options->hours, 0.5);
    EXPECT_EQ(options->cases, 0u);
    EXPECT_EQ(options->seed, 7u);
    EXPECT_TRUE(options->cpu && options->vulkan && options->only_list);
    EXPECT_EQ(options->most_failures, 3u);
    EXPECT_EQ(options->out, "elsewhere");
    EXPECT_EQ(parse({"sweep", "a.obj", "--size", "8x4"})->height, 4u);
    EXPECT_EQ(parse({"replay", "a.txt", "b.txt"})->files.size(), 2u);
    EXPECT_GT(parse({"one-picture"})->cases, 0u);
    EXPECT_EQ(parse({"questions", "--case", "5"})->only_case, 5u);
    EXPECT_EQ(parse({"calls", "--hours", "1"})->mode, Mode::kCalls);
    EXPECT_FALSE(parse({"sweep", "--help"}).has_value());
}

TEST(FuzzOptions, InvalidOnesAreRefusedWithAReason) {
    const std::vector<std::vector<std::string>> wrong = {
        {},
        {"image"},
        {"one-picture", "--hours", "0"},
        {"one-picture", "--hours", "-1"},
        {"one-picture", "--cases"},
        {"one-picture", "--cases", "0"},
        {"one-picture", "--backend", "gpu"},
        {"one-picture", "--every", "2"},
        {"one-picture", "stray"},
        {"questions", "--size", "4x4"},
        {"sweep"},
        {"sweep", "a", "b"},
        {"sweep", "a", "--size", "4"},
        {"replay"},
        {"replay", "a", "--list"},
    };
    for (const auto& arguments : wrong) {
        try {
            parse(arguments);
            ADD_FAILURE() << testing::PrintToString(arguments);
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kBadArgument);
            EXPECT_STRNE(error.what(), "");
        }
    }
}

}  // namespace
}  // namespace mray::fuzz
