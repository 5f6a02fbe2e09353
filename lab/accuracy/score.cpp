#include "lab/accuracy/score.h"

#include <tbb/enumerable_thread_specific.h>

#include <cmath>

namespace mray::lab {
namespace {

/// The probability that at most k of n trials succeed, each with probability p, for k <= n p.
double at_most(double k, double n, double p) {
    double term = std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1) +
                           k * std::log(p) + (n - k) * std::log1p(-p));
    double sum = 0;
    // Terms decay fast.
    for (double i = k; i >= 0 && term > 1e-18 * sum; --i) {
        sum += term;
        term *= i / (n - i + 1) * ((1 - p) / p);
    }
    return sum;
}

/// The p at which at_most() is 2.5 %.
double upper_rate(double k, double n) {
    double lower = k / n;
    double upper = 1;
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (lower + upper);
        (at_most(k, n, middle) > 0.025 ? lower : upper) = middle;
    }
    return upper;
}

}  // namespace

Rate rate_of(std::uint64_t count, std::uint64_t trials) {
    if (trials == 0) return {};
    const auto k = static_cast<double>(count);
    const auto n = static_cast<double>(trials);
    return {k / n, count == 0 ? 0 : 1 - upper_rate(n - k, n),
            count == trials ? 1 : upper_rate(k, n)};
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
    : referee_(referee), set_(set), known_(set.rays.size()) {
    for_each_tile(set, set.whole(), [&](const TileRays& tile) {
        for (std::size_t i = tile.begin; i < tile.end; ++i) {
            if (set.active[i] == 0) continue;
            const std::uint64_t before = ExactTriangle::exact_count();
            const Truth truth = referee.closest(set.rays[i]);
            const bool exact = ExactTriangle::exact_count() != before;
            const std::uint32_t answer = set.any_hit() ? truth.hit() : truth.prim_id;
            known_[i] = {truth, exact, answer, Verdict::kRight, exact};
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
            Known& known = known_[i];
            if (known.answer != answer) {
                const std::uint64_t before = ExactTriangle::exact_count();
                known.answer = answer;
                known.verdict = set_.any_hit()
                                    ? referee_.judge_occlusion(ray, known.truth, answer != 0)
                                    : referee_.judge(ray, known.truth, answer);
                known.exact = known.exact_truth || ExactTriangle::exact_count() != before;
            }
            score.exact += known.exact;
            ++score.verdicts[static_cast<std::size_t>(known.verdict)];
            ++score.rays;
            if (set_.any_hit() || known.verdict != Verdict::kRight || !known.truth.hit()) continue;
            const std::array<double, 3> errors = referee_.errors(ray, answers.hits[i]);
            for (std::size_t k = 0; k < 3; ++k) score.errors[k].add(errors[k]);
        }
    });
    Score sum;
    for (const Score& score : scores) sum += score;
    return sum;
}

}  // namespace mray::lab
