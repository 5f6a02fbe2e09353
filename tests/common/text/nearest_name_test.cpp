#include "common/text/text_parts.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace mray {
namespace {

const std::vector<std::string> kNames = {"render", "crosscheck", "probe", "profile"};

TEST(SimilarName, IsFoundAcrossTypingErrors) {
    EXPECT_EQ(similar_name("rednr", kNames), "render");
    EXPECT_EQ(similar_name("crosschek", kNames), "crosscheck");
    EXPECT_EQ(similar_name("prboe", kNames), "probe");
    EXPECT_EQ(similar_name("zzzzzz", kNames), "");
    EXPECT_EQ(similar_name(std::string(100000, 'x'), kNames), "");
    EXPECT_EQ(similar_name("render", {}), "");
    EXPECT_EQ(suggestion("rednr", kNames), "; did you mean render?");
    EXPECT_EQ(suggestion("zzzzzz", kNames), "");
}

}  // namespace
}  // namespace mray
