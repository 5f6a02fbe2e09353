// Compares a run of `profile` with the report of an earlier one.
#pragma once

#include <span>
#include <string>

#include "app/report/profile_report.h"

namespace mray::app {

/// Reads a report of `profile --json`. Throws Error(kBadInput) unless it has the head, rays and
/// options of `report`, and just these frames on these backends.
ProfileReport read_baseline(const std::string& file, const ProfileReport& report,
                            std::span<const std::string> backends, std::span<const double> frames);

struct BaselineComparison {
    /// The medians and spreads of both runs side by side, and the stages that became slower.
    std::string text;
    bool is_slower = false;
};

/// A stage is slower if its median exceeds that of the baseline by more than the tolerance.
/// Requires the rows of one to be those of the other.
BaselineComparison compare_with_baseline(const std::string& file, const ProfileReport& baseline,
                                         const ProfileReport& report, double tolerance_percent);

}  // namespace mray::app
