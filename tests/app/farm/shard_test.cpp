// How frames are dealt out to shards, and who is right when shards differ.
#include "app/base/shard.h"

#include <gtest/gtest.h>

#include <map>

#include "app/commands/merge/opinions.h"
#include "common/base/errors.h"

namespace mray::app {
namespace {

TEST(Shard, BlocksHaveEachFrameOnceInOrder) {
    for (const std::size_t frames : {0, 1, 2, 3, 7, 24, 25, 100, 1000, 1'000'000}) {
        for (const std::uint32_t count : {1u, 2u, 3u, 7u, 8u, 25u, 64u, 1000u, kMaxShards}) {
            std::size_t end = 0;
            for (std::uint32_t i = 1; i <= count; ++i) {
                const Block block = block_of(frames, {i, count});
                ASSERT_EQ(block.begin, end) << i << '/' << count << " of " << frames;
                ASSERT_LE(block.begin, block.end);
                // As equal as possible.
                ASSERT_LE(block.end - block.begin, frames / count + 1);
                ASSERT_GE(block.end - block.begin, frames / count);
                end = block.end;
            }
            ASSERT_EQ(end, frames);
        }
    }
}

TEST(Shard, OwnerIsTheShardWhoseBlockHasTheFrame) {
    for (const std::size_t frames : {1, 2, 3, 7, 24, 25, 100}) {
        for (const std::uint32_t count : {1u, 2u, 3u, 7u, 8u, 25u, 64u, 1000u}) {
            for (std::uint32_t shard = 1; shard <= count; ++shard) {
                const Block block = block_of(frames, {shard, count});
                for (std::size_t i = block.begin; i < block.end; ++i)
                    ASSERT_EQ(owner_of(frames, i, count), shard);
            }
        }
    }
}

TEST(Shard, EveryKthFrameIsCheckedByTwoOthers) {
    for (const std::size_t frames : {1, 2, 3, 7, 24, 25, 100}) {
        for (const std::uint32_t count : {1u, 2u, 3u, 7u, 8u, 64u}) {
            for (const std::uint32_t every : {0u, 1u, 2u, 5u, 200u}) {
                std::map<std::size_t, std::uint32_t> opinions;
                for (std::uint32_t shard = 1; shard <= count; ++shard) {
                    for (const std::size_t i : checked_frames(frames, {shard, count}, every)) {
                        ASSERT_NE(owner_of(frames, i, count), shard);
                        ++opinions[i];
                    }
                }
                for (std::size_t i = 0; i < frames; ++i) {
                    const bool is_checked = every > 0 && i % every == 0;
                    ASSERT_EQ(opinions[i], is_checked ? std::min(2u, count - 1) : 0);
                }
            }
        }
    }
}

TEST(Shard, ParsesWholeNumbersInRange) {
    EXPECT_EQ(parse_shard("--shard", "1/1"), (Shard{1, 1}));
    EXPECT_EQ(parse_shard("--shard", "7/65536"), (Shard{7, 65536}));
    for (const char* text :
         {"", "/", "1", "1/", "/1", "0/1", "2/1", "1/65537", "-1/2", "+1/2", "1 /2", "1/2/3",
          "1.0/2", "0x1/2", "99999999999999999999/99999999999999999999", "18446744073709551617/2"})
        EXPECT_THROW(parse_shard("--shard", text), Error) << text;
}

Opinion opinion(std::uint32_t shard, std::uint64_t hash) { return {shard, "host", hash, 1}; }

TEST(Opinions, ThatAgreeAreNotWrong) {
    EXPECT_TRUE(judge(std::vector{opinion(1, 5)}).wrong.empty());
    EXPECT_TRUE(judge(std::vector{opinion(1, 5), opinion(2, 5)}).wrong.empty());
    EXPECT_TRUE(judge(std::vector{opinion(1, 5), opinion(2, 5), opinion(3, 5)}).wrong.empty());
}

TEST(Opinions, TheOneOfThreeThatDiffersIsWrong) {
    const Verdict verdict = judge(std::vector{opinion(1, 5), opinion(2, 6), opinion(3, 5)});
    EXPECT_TRUE(verdict.is_decided);
    ASSERT_EQ(verdict.wrong.size(), 1u);
    EXPECT_EQ(verdict.wrong[0].shard, 2u);
}

TEST(Opinions, TwoThatDifferAreBothNamed) {
    const Verdict verdict = judge(std::vector{opinion(1, 5), opinion(2, 6)});
    EXPECT_FALSE(verdict.is_decided);
    EXPECT_EQ(verdict.wrong.size(), 2u);
}

TEST(Opinions, ThreeThatAllDifferAreAllNamed) {
    const Verdict verdict = judge(std::vector{opinion(1, 5), opinion(2, 6), opinion(3, 7)});
    EXPECT_FALSE(verdict.is_decided);
    EXPECT_EQ(verdict.wrong.size(), 3u);
}

TEST(Opinions, HitsCountLikePixels) {
    Opinion other = opinion(2, 5);
    other.hits_hash = 2;
    EXPECT_EQ(judge(std::vector{opinion(1, 5), other, opinion(3, 5)}).wrong.size(), 1u);
}

TEST(Opinions, SuspectsAreCountedByShardAndHost) {
    std::vector<Suspect> suspects;
    add_suspects(judge(std::vector{opinion(1, 5), opinion(2, 6), opinion(3, 5)}), suspects);
    add_suspects(judge(std::vector{opinion(2, 6), opinion(3, 5), opinion(4, 5)}), suspects);
    add_suspects(judge(std::vector{opinion(4, 6), opinion(2, 5)}), suspects);
    ASSERT_EQ(suspects.size(), 2u);
    EXPECT_EQ(suspects[0].shard, 2u);
    EXPECT_EQ(suspects[0].outvoted, 2u);
    EXPECT_EQ(suspects[0].undecided, 1u);
    EXPECT_EQ(suspects[1].shard, 4u);
    EXPECT_EQ(suspects[1].outvoted, 0u);
}

}  // namespace
}  // namespace mray::app
