#include "common/simd/simd_target.h"

#include <gtest/gtest.h>

#include <optional>

#include "common/base/errors.h"

namespace mray {
namespace {

std::optional<ErrorKind> kind_of(const char* name) {
    try {
        find_simd_target(name);
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
        return error.kind();
    }
    return std::nullopt;
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
    EXPECT_EQ(kind_of("neon"), ErrorKind::kUnavailable);
#else
    EXPECT_EQ(kind_of("avx2"), ErrorKind::kUnavailable);
#endif
    EXPECT_EQ(kind_of("avx1024"), ErrorKind::kBadArgument);
    EXPECT_EQ(kind_of("AVX2"), ErrorKind::kBadArgument);
}

}  // namespace
}  // namespace mray
