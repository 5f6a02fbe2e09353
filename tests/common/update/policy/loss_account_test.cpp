// When a loss has paid for its remedy.
#include "common/update/policy/loss_account.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

TEST(LossAccount, IsDueWhenWhatWasLostReachesThePrice) {
    LossAccount account;
    account.add(3);
    // Lost: 3 and half of the frame to come.
    EXPECT_TRUE(account.is_due(2, 4));
    EXPECT_FALSE(account.is_due(2, 4.01));
}

TEST(LossAccount, IsDueWhenTheGrowthOfTheLossReachesThePrice) {
    LossAccount account;
    account.add(0);
    account.add(0);
    // Two frames lost 8 less than the one to come, of which half counts.
    EXPECT_TRUE(account.is_due(8, 20));
    EXPECT_FALSE(account.is_due(8, 20.01));
}

TEST(LossAccount, IsNotDueWithoutALoss) {
    LossAccount account;
    account.add(100);
    EXPECT_FALSE(account.is_due(0, 1));
}

}  // namespace
}  // namespace mray
