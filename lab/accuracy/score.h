// How often a method is wrong, how far its right answers are off, and how fast it is.
#pragma once

#include "lab/accuracy/exact_referee.h"
#include "lab/methods/tracers.h"
#include "report/spread.h"

namespace mray::lab {

/// The part of trials in which something happens, and its exact 95 % interval (C. J. Clopper, E. S.
/// Pearson. The Use of Confidence or Fiducial Limits. 1934).
struct Rate {
    double value = 0;
    double lower = 0;
    double upper = 1;
};
/// `count` of `trials`; for none of 0 trials anything is possible.
Rate rate_of(std::uint64_t count, std::uint64_t trials);

/// Counts errors in classes 1/32 of an octave wide, from 2^-20 to 2^40.
class ErrorCounts {
public:
    void add(double error);
    ErrorCounts& operator+=(const ErrorCounts& other);

    std::uint64_t count() const { return count_; }
    double largest() const { return largest_; }
    /// The error that this part (0 to 1) of all errors does not exceed, rounded up to 2.2 %; 0 for
    /// none.
    double quantile(double part) const;

private:
    static constexpr std::size_t kOctave = 32;
    static constexpr int kLeast = -20;

    /// The first class has what is below 2^kLeast.
    std::vector<std::uint64_t> classes_ = std::vector<std::uint64_t>(60 * kOctave + 1);
    std::uint64_t count_ = 0;
    double largest_ = 0;
};

/// What a method did with the rays that it was given.
struct Score {
    std::array<std::uint64_t, kVerdictCount> verdicts{};
    std::uint64_t rays = 0;
    /// Rays for whose verdict doubles did not suffice.
    std::uint64_t exact = 0;
    /// Of t in ulp, of u and v in ulp of 1, where a right answer is a hit.
    std::array<ErrorCounts, 3> errors;
    /// Of each chunk of rays and round.
    std::vector<double> mrays;
    double ms = 0;

    Score& operator+=(const Score& other);
    std::uint64_t operator[](Verdict verdict) const {
        return verdicts[static_cast<std::size_t>(verdict)];
    }
    std::uint64_t wrong() const;
    /// All 0 without rays.
    Spread speed() const { return mrays.empty() ? Spread{} : spread_of(mrays); }
    /// Rays over time, of all chunks.
    double mrays_per_second() const { return ms > 0 ? static_cast<double>(rays) / (1e3 * ms) : 0; }
};

/// The exact answers to a set of rays, which it outlives as the referee does.
class Judge {
public:
    Judge(const ExactReferee& referee, const RaySet& set);

    /// Judges the answers to the rays of some tiles. Times are not set. One call at a time.
    Score score(const TraceAnswers& answers, const TileRange& tiles) const;

private:
    struct Known {
        Truth truth;
        /// True if the truth needed integers.
        bool exact_truth;
        /// The answer that was judged last, as wrong methods often agree; at first the right one.
        std::uint32_t answer;
        Verdict verdict;
        /// True if the truth or the verdict needed integers.
        bool exact;
    };

    const ExactReferee& referee_;
    const RaySet& set_;
    mutable std::vector<Known> known_;
};

}  // namespace mray::lab
