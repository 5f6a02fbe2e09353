#include "bench/full_window.h"

#include <gtest/gtest.h>

#include <vector>

namespace mray::bench {
namespace {

constexpr std::uint32_t kSide = 64;

/// An image that is a hit where `is_hit(x, y)`.
template <class IsHit>
Window window_of(IsHit is_hit) {
    std::vector<std::uint8_t> hits;
    for (std::uint32_t y = 0; y < kSide; ++y) {
        for (std::uint32_t x = 0; x < kSide; ++x) hits.push_back(is_hit(x, y));
    }
    return find_full_window(hits, kSide);
}

bool within(std::uint32_t i, std::uint32_t begin, std::uint32_t end) {
    return i >= begin && i < end;
}

TEST(FindFullWindow, IsTheWholeImageIfAllOfItIsFull) {
    const Window window = window_of([](auto, auto) { return true; });
    EXPECT_EQ(window.side, kSide);
    EXPECT_EQ(window.hit_share, 1.0);
}

TEST(FindFullWindow, FindsASquareAnywhere) {
    const Window window =
        window_of([](auto x, auto y) { return within(x, 41, 60) && within(y, 3, 22); });
    // A pixel larger it would be 90 % full, a pixel aside 94.7 %.
    EXPECT_EQ(window.side, 19u);
    EXPECT_EQ(window.x, 41u);
    EXPECT_EQ(window.y, 3u);
    EXPECT_EQ(window.hit_share, 1.0);
}

TEST(FindFullWindow, LetsAFewPixelsMiss) {
    const Window window =
        window_of([](auto x, auto y) { return !(within(x, 0, 10) && within(y, 0, 10)); });
    EXPECT_EQ(window.side, kSide);
    EXPECT_NEAR(window.hit_share, 1 - 100.0 / (kSide * kSide), 1e-12);
}

TEST(FindFullWindow, TakesTheOneNearestToTheMiddle) {
    const Window window = window_of([](auto x, auto y) {
        return within(y, 22, 41) && (within(x, 0, 19) || within(x, 30, 49));
    });
    EXPECT_EQ(window.x, 30u);
    EXPECT_EQ(window.y, 22u);
}

TEST(FindFullWindow, TakesTheFullestIfNoneIsFull) {
    // In every square one pixel in four is a hit, on the right one in two.
    const Window window =
        window_of([](auto x, auto y) { return y % 2 == 0 && (x % 2 == 0 || x >= 56); });
    EXPECT_EQ(window.side, kSide / kMaxZoom);
    EXPECT_EQ(window.x, 56u);
    EXPECT_EQ(window.hit_share, 0.5);
}

TEST(FindFullWindow, IsTheWholeImageWithoutHits) {
    const Window window = window_of([](auto, auto) { return false; });
    EXPECT_EQ(window.side, kSide);
    EXPECT_EQ(window.hit_share, 0.0);
}

}  // namespace
}  // namespace mray::bench
