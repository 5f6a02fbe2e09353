// Case after case.
#pragma once

#include <cstdint>
#include <optional>

#include "common/base/stopwatch.h"
#include "tests/fuzz/case/lanes.h"
#include "tests/fuzz/generate/generator.h"
#include "tests/fuzz/shrink/failure_desk.h"

namespace morphray::fuzz {

struct CampaignConfig {
    std::uint64_t seed = 1;
    /// Of all lanes together; 0: until the time is over.
    std::uint64_t cases = 0;
    /// 0: until the cases are done.
    double seconds = 0;
    /// After so many failing cases it ends.
    std::uint64_t most_failures = 10;
    /// Instead of a campaign, the case of this seed.
    std::optional<std::uint64_t> only_case;
    FailureConfig failure;
};

/// A lane's part. Ends early after SIGINT or SIGTERM. Returns an exit code.
int run_campaign(const CampaignConfig& config, const Lane& lane, LaneState& state,
                 std::atomic<std::uint64_t>& failures);

/// "1200 cases, 15600 images (2400 near a plane), ..." for the end and on the way.
std::string summary(const Tally& tally, double seconds);

/// Tells on stderr every few seconds how far a lane is.
class LaneProgress {
public:
    explicit LaneProgress(const Lane& lane);
    void update(const Tally& tally);
    double seconds() const;

private:
    static constexpr double kSeconds = 5;

    std::string name_;
    Stopwatch watch_;
    double next_ = kSeconds;
};

}  // namespace morphray::fuzz
