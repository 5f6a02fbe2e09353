#include "tools/measure/change.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>

#include "tools/measure/median.h"
#include "tools/measure/spread.h"

namespace mray {
namespace {

/// Draws of the bootstrap, and the values that all draws together may have.
constexpr std::size_t kMostDraws = 10'000;
constexpr std::size_t kLeastDraws = 400;
constexpr std::size_t kDrawnValues = 20'000'000;

/// Twice the ranks of the values of a stratum, which are whole numbers: before, then after.
struct DoubledRanks {
    std::vector<std::uint32_t> ranks;
    std::size_t before = 0;

    std::size_t after() const { return ranks.size() - before; }
    std::uint64_t sum_after() const {
        return std::accumulate(ranks.begin() + static_cast<std::ptrdiff_t>(before), ranks.end(),
                               std::uint64_t{0});
    }
};

DoubledRanks doubled_ranks(const Stratum& stratum) {
    std::vector<double> values = stratum.before;
    values.insert(values.end(), stratum.after.begin(), stratum.after.end());
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
    DoubledRanks result{std::vector<std::uint32_t>(values.size()), stratum.before.size()};
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
        while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
        // The mean of the ranks begin + 1 to end, doubled.
        for (std::size_t i = begin; i < end; ++i)
            result.ranks[order[i]] = static_cast<std::uint32_t>(begin + 1 + end);
    }
    return result;
}

/// The chance of each doubled rank sum of a random choice of as many values as there are after.
std::vector<double> rank_sum_chances(const DoubledRanks& doubled) {
    const std::size_t chosen = doubled.after();
    const std::size_t most = std::accumulate(doubled.ranks.begin(), doubled.ranks.end(), 0u);
    // chance[k][s]: of the values so far, k are chosen and their ranks add up to s.
    std::vector<std::vector<double>> chance(chosen + 1, std::vector<double>(most + 1, 0));
    chance[0][0] = 1;
    std::size_t seen = 0;
    for (const std::uint32_t rank : doubled.ranks) {
        // Each of the values that are left is chosen with the same chance.
        const auto left = static_cast<double>(doubled.ranks.size() - seen);
        for (std::size_t k = std::min(seen, chosen) + 1; k-- > 0;) {
            const double take = std::max(0.0, static_cast<double>(chosen - k)) / left;
            for (std::size_t s = most + 1; s-- > 0;) {
                const double here = chance[k][s];
                if (here == 0) continue;
                chance[k][s] = here * (1 - take);
                if (take > 0) chance[k + 1][s + rank] += here * take;
            }
        }
        ++seen;
    }
    return chance[chosen];
}

double exact_chance(std::span<const Stratum> strata) {
    std::vector<double> chances = {1};
    std::uint64_t measured = 0;
    for (const Stratum& stratum : strata) {
        const DoubledRanks doubled = doubled_ranks(stratum);
        measured += doubled.sum_after();
        const std::vector<double> added = rank_sum_chances(doubled);
        std::vector<double> sums(chances.size() + added.size() - 1, 0);
        for (std::size_t i = 0; i < chances.size(); ++i) {
            if (chances[i] == 0) continue;
            for (std::size_t j = 0; j < added.size(); ++j) sums[i + j] += chances[i] * added[j];
        }
        chances = std::move(sums);
    }
    double chance = 0;
    for (std::size_t s = chances.size(); s-- > measured;) chance += chances[s];
    return std::min(1.0, chance);
}

double normal_chance(std::span<const Stratum> strata) {
    double excess = 0;
    double variance = 0;
    for (const Stratum& stratum : strata) {
        const DoubledRanks doubled = doubled_ranks(stratum);
        const auto n = static_cast<double>(doubled.ranks.size());
        const auto before = static_cast<double>(doubled.before);
        const auto after = static_cast<double>(doubled.after());
        if (before == 0 || after == 0) continue;
        const double mean = n + 1;
        double squares = 0;
        for (const std::uint32_t rank : doubled.ranks) squares += (rank - mean) * (rank - mean);
        excess += static_cast<double>(doubled.sum_after()) - after * mean;
        variance += squares / n * before * after / (n - 1);
    }
    if (variance == 0) return 1;
    // Rank sums are whole numbers: half of one, doubled.
    return 0.5 * std::erfc((excess - 1) / std::sqrt(2 * variance));
}

double median_log_ratio(std::span<const Stratum> strata) {
    std::vector<double> logs;
    for (const Stratum& stratum : strata)
        logs.push_back(std::log(median(stratum.after) / median(stratum.before)));
    return median(logs);
}

}  // namespace

double chance_of_rise(std::span<const Stratum> strata) {
    std::size_t values = 0;
    for (const Stratum& stratum : strata) values += stratum.before.size() + stratum.after.size();
    if (values == 0) return 1;
    return values <= kMostExact ? exact_chance(strata) : normal_chance(strata);
}

double least_chance(std::span<const Stratum> strata) {
    double log_chance = 0;
    for (const Stratum& stratum : strata) {
        const auto before = static_cast<double>(stratum.before.size());
        const auto after = static_cast<double>(stratum.after.size());
        log_chance += std::lgamma(before + 1) + std::lgamma(after + 1);
        log_chance -= std::lgamma(before + after + 1);
    }
    return std::exp(log_chance);
}

std::size_t least_values(std::size_t strata, double level) {
    for (std::size_t n = 1;; ++n) {
        const Stratum stratum{std::vector<double>(n), std::vector<double>(n)};
        if (least_chance(std::vector(strata, stratum)) < level) return n;
    }
}

std::vector<double> corrected_chances(std::span<const double> chances) {
    std::vector<std::size_t> order(chances.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return chances[i]; });
    std::vector<double> corrected(chances.size());
    double largest = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const auto left = static_cast<double>(order.size() - i);
        largest = std::max(largest, std::min(1.0, left * chances[order[i]]));
        corrected[order[i]] = largest;
    }
    return corrected;
}

RatioInterval ratio_of_medians(std::span<const Stratum> strata, double confidence) {
    assert(!strata.empty());
    std::size_t values = 0;
    for (const Stratum& stratum : strata) values += stratum.before.size() + stratum.after.size();
    std::mt19937_64 generator;
    const auto draw = [&generator](const std::vector<double>& from, std::vector<double>& drawn) {
        drawn.resize(from.size());
        for (double& value : drawn) value = from[generator() % from.size()];
    };
    std::vector<Stratum> drawn(strata.size());
    std::vector<double> logs(std::clamp(kDrawnValues / values, kLeastDraws, kMostDraws));
    for (double& log_ratio : logs) {
        for (std::size_t i = 0; i < strata.size(); ++i) {
            draw(strata[i].before, drawn[i].before);
            draw(strata[i].after, drawn[i].after);
        }
        log_ratio = median_log_ratio(drawn);
    }
    std::ranges::sort(logs);
    const double tail = (1 - confidence) / 2;
    return {std::exp(median_log_ratio(strata)), std::exp(quantile(logs, tail)),
            std::exp(quantile(logs, 1 - tail))};
}

}  // namespace mray
