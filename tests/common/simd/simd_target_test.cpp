#include "common/simd/simd_target.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/support/thrown_error.h"

namespace mray {
namespace {

void expect_error(const char* name, ErrorKind kind) {
    const std::optional<Error> error = test::error_of([&] { find_simd_target(name); });
    ASSERT_TRUE(error) << name;
    EXPECT_EQ(error->kind(), kind) << name;
    EXPECT_TRUE(test::has(error->what(), name));
}

TEST(SimdTarget, BestIsTheFirstAndScalarTheLast) {
    const std::vector<SimdTarget> targets = supported_simd_targets();
    ASSERT_FALSE(targets.empty());
    EXPECT_STREQ(targets.back().name, "scalar");
    EXPECT_EQ(find_simd_target(""), targets.front());
    EXPECT_EQ(find_simd_target("best"), targets.front());
}

TEST(SimdTarget, WhatIsElsewhereIsUnavailableAndWhatIsNothingIsUsage) {
#if defined(__x86_64__)
    expect_error("neon", ErrorKind::kUnavailable);
#else
    expect_error("avx2", ErrorKind::kUnavailable);
#endif
    expect_error("avx1024", ErrorKind::kBadArgument);
    expect_error("AVX2", ErrorKind::kBadArgument);
}

}  // namespace
}  // namespace mray
