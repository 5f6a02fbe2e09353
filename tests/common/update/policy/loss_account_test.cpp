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

TEST(LossAccount, RemedyThatSavedHalfItsPriceHalvesTheBackoffAndOthersDoubleIt) {
    LossAccount account;
    account.add(10);
    account.start_over(8);
    EXPECT_EQ(account.backoff(), 1);  // no remedy before it
    EXPECT_EQ(account.lost(), 0);
    // Saves 3 of 8.
    account.add(7);
    account.start_over(8);
    EXPECT_EQ(account.backoff(), 2);
    // Each is compared with the frame before the last remedy, which lost 7: saves 2 and 2.
    account.add(5);
    account.add(5);
    account.start_over(8);
    EXPECT_EQ(account.backoff(), 1);
}

TEST(LossAccount, BackoffMultipliesThePriceUpToSixteenTimes) {
    LossAccount account;
    for (int i = 0; i < 10; ++i) {
        account.add(6);
        account.start_over(100);
    }
    EXPECT_EQ(account.backoff(), 16);
    account.add(12);
    EXPECT_TRUE(account.is_due(8, 1));
    EXPECT_FALSE(account.is_due(8, 1.01));
}

TEST(LossAccount, IsNotDueWithoutALoss) {
    LossAccount account;
    account.add(100);
    EXPECT_FALSE(account.is_due(0, 1));
}

}  // namespace
}  // namespace mray
