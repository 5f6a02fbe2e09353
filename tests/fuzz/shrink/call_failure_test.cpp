#include "tests/fuzz/shrink/call_failure.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "morphray/morphray.hpp"
#include "tests/fuzz/generate/calls.h"

namespace mray::fuzz {
namespace {

TEST(Calls, ShrinkToTheOnesThatFail) {
    FuzzCase failing;
    for (std::uint32_t i = 0; i < 20; ++i)
        failing.calls.push_back({static_cast<CallKind>(i % 11), i % 3, 100 + i, i});
    // An attach before rays of at least 13.
    const FuzzCase small = shrink_calls(failing, [](const FuzzCase& one) {
        const auto attach = std::ranges::find(one.calls, CallKind::kAttach, &Call::kind);
        return std::any_of(attach, one.calls.end(), [](const Call& call) {
            return call.kind == CallKind::kRays && call.number >= 13;
        });
    });
    ASSERT_EQ(small.calls.size(), 2u);
    EXPECT_EQ(small.calls[0].kind, CallKind::kAttach);
    EXPECT_EQ(small.calls[0].number, 0u);
    EXPECT_EQ(small.calls[1].kind, CallKind::kRays);
    EXPECT_EQ(small.calls[1].number, 13u);
}

TEST(Calls, ThatArePlayedByAnotherDeviceDifferFromOtherCalls) {
    const CallDevices cpu{"cpu", {morphray::Device::cpu({.threads = 1})}};
    FuzzCase fuzz_case;
    fuzz_case.calls = {{CallKind::kBuild, 0, 3, 1},
                       {CallKind::kMove, 0, 0, 2},
                       {CallKind::kUpdate, 0, 0, 3},
                       {CallKind::kRays, 0, 40, 4}};
    FuzzCase played = fuzz_case;
    const CallModel model(played);
    EXPECT_FALSE(model.compare(cpu).has_value());
    EXPECT_EQ(model.question_count(), 40u);
    // Another ray has another answer.
    ++played.calls[3].number;
    const std::optional<CallDifference> found = model.compare(cpu);
    ASSERT_TRUE(found.has_value());
    EXPECT_EQ(found->call, 3u);
    EXPECT_EQ(found->count, 1u);
    EXPECT_EQ(describe(*found, fuzz_case).find("call 4 (rays, scene 0): "), 0u);
}

}  // namespace
}  // namespace mray::fuzz
