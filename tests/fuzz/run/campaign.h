// Tries cases of consecutive seeds.
#pragma once

#include <cstdint>
#include <optional>

#include "common/base/stopwatch.h"
#include "tests/fuzz/generate/generator.h"
#include "tests/fuzz/run/workers.h"
#include "tests/fuzz/shrink/failure_report.h"

namespace mray::fuzz {

struct CampaignConfig {
    std::uint64_t seed = 1;
    /// The number of cases of all workers together; 0: until the time is over.
    std::uint64_t cases = 0;
    /// 0: until the cases are done.
    double seconds = 0;
    /// The campaign ends after this many failing cases.
    std::uint64_t most_failures = 10;
    /// Tries only the case of this seed.
    std::optional<std::uint64_t> only_case;
    /// Cases of questions alone instead of images.
    bool asks_questions = false;
    FailureConfig failure;
};

/// Runs a worker's part. Ends early after SIGINT or SIGTERM. Returns an exit code.
int run_campaign(const CampaignConfig& config, const Worker& worker, WorkerState& state,
                 std::atomic<std::uint64_t>& failures);

/// "1200 cases, 15600 images (2400 near a plane), ...", for progress and for the end.
std::string summary(const Tally& tally, double seconds);

/// Writes the progress of a worker to stderr every few seconds.
class WorkerProgress {
public:
    explicit WorkerProgress(const Worker& worker);
    void update(const Tally& tally);
    double seconds() const;

private:
    static constexpr double kSeconds = 5;

    std::string name_;
    Stopwatch watch_;
    double next_ = kSeconds;
};

}  // namespace mray::fuzz
