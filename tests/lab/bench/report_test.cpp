#include "lab/bench/report.h"

#include <gtest/gtest.h>

namespace mray::bench {
namespace {

TEST(TimeInTurn, RunsEveryMethodOnceMoreThanTimedAndPreparesBeforeEachRound) {
    constexpr std::size_t kParts = 3;
    constexpr int kRepeat = 2;
    int prepared = 0;
    std::vector<int> runs(kParts);
    int others = 0;
    const Method methods[] = {{"a", [&] { ++prepared; }, [&](std::size_t i) { return ++runs[i]; }},
                              {"b", {}, [&](std::size_t) { return ++others; }}};
    const std::vector<Times> times = time_in_turn(methods, kParts, kRepeat);
    EXPECT_EQ(prepared, kRepeat + 1);
    EXPECT_EQ(runs, (std::vector<int>(kParts, kRepeat + 1)));
    EXPECT_EQ(others, static_cast<int>(kParts) * (kRepeat + 1));
    ASSERT_EQ(times.size(), 2u);
    // The runs after the first return 2 and 3 for each part.
    EXPECT_EQ(times[0].median_ms, 7.5);
    EXPECT_EQ(times[0].least_ms, 6);
}

TEST(FastestOfGroups, TakesTheLeastTimesOfEachGroup) {
    std::vector<Method> methods(5);
    for (std::size_t i = 0; i < methods.size(); ++i) methods[i].group = i % 2 == 0 ? "even" : "odd";
    std::vector<Times> times(5);
    const double least[] = {3, 7, 1, 5, 2};
    for (std::size_t i = 0; i < times.size(); ++i) times[i].least_ms = least[i];
    EXPECT_EQ(fastest_of_groups(methods, times, 1), (std::vector<std::size_t>{2, 3}));
    EXPECT_EQ(fastest_of_groups(methods, times, 2), (std::vector<std::size_t>{2, 4, 3, 1}));
}

}  // namespace
}  // namespace mray::bench
