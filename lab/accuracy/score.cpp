#include "lab/accuracy/score.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>

namespace mray::lab {
namespace {

/// The regularized incomplete beta function by its continued fraction, evaluated by the method of
/// Lentz (W. H. Press et al. Numerical Recipes. 2007, 6.4).
double beta_fraction(double a, double b, double x) {
    constexpr double kTiny = 1e-300;
    const auto nonzero = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
    double c = 1;
    double d = 1 / nonzero(1 - (a + b) * x / (a + 1));
    double result = d;
    for (int m = 1; m < 100'000; ++m) {
        const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
        d = 1 / nonzero(1 + even * d);
        c = nonzero(1 + even / c);
        result *= d * c;
        const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
        d = 1 / nonzero(1 + odd * d);
        c = nonzero(1 + odd / c);
        result *= d * c;
        if (std::abs(d * c - 1) < 1e-14) break;
    }
    return result;
}

double incomplete_beta(double a, double b, double x) {
    if (x <= 0 || x >= 1) return x <= 0 ? 0 : 1;
    const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                  a * std::log(x) + b * std::log1p(-x));
    if (x < (a + 1) / (a + b + 2)) return front * beta_fraction(a, b, x) / a;
    return 1 - front * beta_fraction(b, a, 1 - x) / b;
}

/// The x at which the incomplete beta function has this value.
double inverse_beta(double a, double b, double value) {
    double lower = 0;
    double upper = 1;
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (lower + upper);
        (incomplete_beta(a, b, middle) < value ? lower : upper) = middle;
    }
    return upper;
}

}  // namespace

Rate rate_of(std::uint64_t count, std::uint64_t trials) {
    if (trials == 0) return {};
    const auto k = static_cast<double>(count);
    const auto n = static_cast<double>(trials);
    constexpr double kTail = 0.025;
    return {k / n, count == 0 ? 0 : inverse_beta(k, n - k + 1, kTail),
            count == trials ? 1 : inverse_beta(k + 1, n - k, 1 - kTail)};
}

void ErrorCounts::add(double error) {
    std::size_t at = 0;
    if (error > std::ldexp(1, kLeast)) {
        const double place = std::ceil(kOctave * (std::log2(error) - kLeast));
        at = std::min(static_cast<std::size_t>(place), classes_.size() - 1);
    }
    ++classes_[at];
    ++count_;
    largest_ = std::max(largest_, error);
}

ErrorCounts& ErrorCounts::operator+=(const ErrorCounts& other) {
    for (std::size_t i = 0; i < classes_.size(); ++i) classes_[i] += other.classes_[i];
    count_ += other.count_;
    largest_ = std::max(largest_, other.largest_);
    return *this;
}

double ErrorCounts::quantile(double part) const {
    const double wanted = part * static_cast<double>(count_);
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < classes_.size(); ++i) {
        sum += classes_[i];
        if (static_cast<double>(sum) < wanted || sum == 0) continue;
        if (i == 0) return 0;
        return std::min(largest_, std::exp2(kLeast + static_cast<double>(i) / kOctave));
    }
    return 0;
}

Score& Score::operator+=(const Score& other) {
    for (std::size_t i = 0; i < kVerdictCount; ++i) verdicts[i] += other.verdicts[i];
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] += other.errors[i];
    rays += other.rays;
    exact += other.exact;
    ms += other.ms;
    mrays.insert(mrays.end(), other.mrays.begin(), other.mrays.end());
    return *this;
}

std::uint64_t Score::wrong() const {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < kVerdictCount; ++i)
        if (is_wrong(static_cast<Verdict>(i))) sum += verdicts[i];
    return sum;
}

Judge::Judge(const ExactReferee& referee, const RaySet& set)
    : referee_(referee),
      set_(set),
      truths_(set.rays.size()),
      exact_(set.rays.size()),
      last_(set.rays.size()) {
    for_each_tile(set, set.whole(), [&](const TileRays& tile) {
        for (std::size_t i = tile.begin; i < tile.end; ++i) {
            if (set.active[i] == 0) continue;
            const std::uint64_t before = ExactTriangle::exact_count();
            truths_[i] = referee.closest(set.rays[i]);
            exact_[i] = ExactTriangle::exact_count() != before;
        }
    });
}

Score Judge::score(const TraceAnswers& answers, const TileRange& tiles) const {
    tbb::enumerable_thread_specific<Score> scores;
    for_each_tile(set_, tiles, [&](const TileRays& tile) {
        Score& score = scores.local();
        for (std::size_t i = tile.begin; i < tile.end; ++i) {
            if (set_.active[i] == 0) continue;
            const Ray& ray = set_.rays[i];
            const std::uint32_t answer =
                set_.any_hit() ? answers.occluded[i] : answers.hits[i].prim_id;
            LastAnswer& last = last_[i];
            if (!last.known || last.prim_id != answer) {
                const std::uint64_t before = ExactTriangle::exact_count();
                last = {answer, true,
                        set_.any_hit() ? referee_.judge_occlusion(ray, truths_[i], answer != 0)
                                       : referee_.judge(ray, truths_[i], answer),
                        exact_[i] != 0 || ExactTriangle::exact_count() != before};
            }
            const Verdict verdict = last.verdict;
            score.exact += last.exact;
            ++score.verdicts[static_cast<std::size_t>(verdict)];
            ++score.rays;
            if (set_.any_hit() || verdict != Verdict::kRight || !truths_[i].hit()) continue;
            const std::array<double, 3> errors = referee_.errors(ray, answers.hits[i]);
            for (std::size_t k = 0; k < 3; ++k) score.errors[k].add(errors[k]);
        }
    });
    Score sum;
    for (const Score& score : scores) sum += score;
    return sum;
}

}  // namespace mray::lab
