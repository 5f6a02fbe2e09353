#include "scenes/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/support/test_scene.h"

namespace mray {
namespace {

ScheduleCosts random_costs(std::size_t frames, std::uint64_t seed) {
    test::Random random(seed);
    ScheduleCosts costs;
    for (std::size_t b = 0; b < frames; ++b) {
        costs.first.push_back(random.real(1, 10));
        costs.built.emplace_back();
        for (std::size_t f = b; f < frames; ++f) costs.built[b].push_back(random.real(1, 10));
    }
    return costs;
}

/// The total when a tree is built at the frames whose bits are set.
double total_of(const ScheduleCosts& costs, std::uint32_t builds) {
    double total = 0;
    std::size_t last = 0;
    bool any = false;
    for (std::size_t f = 0; f < costs.first.size(); ++f) {
        if ((builds >> f & 1) != 0) {
            last = f;
            any = true;
        }
        total += any ? costs.built[last][f - last] : costs.first[f];
    }
    return total;
}

TEST(BestSchedule, IsTheLeastOfAllSchedules) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const ScheduleCosts costs = random_costs(10, seed);
        double least = std::numeric_limits<double>::infinity();
        for (std::uint32_t builds = 0; builds < 1u << 10; ++builds)
            least = std::min(least, total_of(costs, builds));
        const Schedule best = best_schedule(costs);
        EXPECT_DOUBLE_EQ(best.total, least);
        std::uint32_t builds = 0;
        for (const std::size_t f : best.rebuilds) builds |= 1u << f;
        EXPECT_DOUBLE_EQ(total_of(costs, builds), least);
    }
}

TEST(BestSchedule, TakesNothingThatWasNotMeasured) {
    ScheduleCosts costs = random_costs(6, 1);
    for (double& cost : costs.first) cost = 1000;
    for (auto& built : costs.built) built.resize(1);
    EXPECT_EQ(best_schedule(costs).rebuilds.size(), 6u);
}

}  // namespace
}  // namespace mray
