#include "common/version.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>

namespace mray {
namespace {

TEST(Version, IsThreeNumbersAndTheDetailBeginsWithThem) {
    EXPECT_EQ(kVersion.find_first_not_of("0123456789."), std::string_view::npos);
    EXPECT_EQ(std::count(kVersion.begin(), kVersion.end(), '.'), 2);
    EXPECT_TRUE(kVersionDetail.starts_with(kVersion));
    EXPECT_EQ(kVersionDetail.find('\n'), std::string_view::npos);
}

}  // namespace
}  // namespace mray
