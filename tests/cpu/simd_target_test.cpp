#include "cpu/simd_target.h"

#include <gtest/gtest.h>

#include "common/error.h"

namespace morphray::cpu {
namespace {

ExitCode code_of(const char* name) {
    try {
        find_simd_target(name);
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
        return error.code();
    }
    return ExitCode::kOk;
}

TEST(SimdTarget, BestIsTheFirstAndScalarTheLast) {
    const std::vector<SimdTarget> targets = supported_simd_targets();
    ASSERT_FALSE(targets.empty());
    EXPECT_STREQ(targets.back().name, "scalar");
    EXPECT_EQ(find_simd_target(""), targets.front());
    EXPECT_EQ(find_simd_target("best"), targets.front());
}

TEST(SimdTarget, EachSupportedOneIsFoundByItsName) {
    for (const SimdTarget& target : supported_simd_targets()) {
        EXPECT_EQ(find_simd_target(target.name), target);
    }
}

TEST(SimdTarget, WhatIsElsewhereIsUnavailableAndWhatIsNothingIsUsage) {
#if defined(__x86_64__)
    EXPECT_EQ(code_of("neon"), ExitCode::kUnavailable);
#else
    EXPECT_EQ(code_of("avx2"), ExitCode::kUnavailable);
#endif
    EXPECT_EQ(code_of("avx1024"), ExitCode::kUsage);
    EXPECT_EQ(code_of("AVX2"), ExitCode::kUsage);
}

}  // namespace
}  // namespace morphray::cpu
