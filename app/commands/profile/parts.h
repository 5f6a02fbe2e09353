// The parts of `profile`: what both kinds have in common, policies, and comparison.
#pragma once

#include <span>
#include <string>

#include "app/base/options.h"
#include "app/report/json_parts.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"
#include "scenes/animation.h"

namespace mray::app {

Json profile_head(const ProfileOptions& options, const Animation& animation);

/// morphray profile --policies: compares update policies over an animation.
ExitCode profile_policies(const ProfileOptions& options, const Messages& messages);

/// Throws Error(kBadInput) unless the report is of the same scene, options, frames and backends.
Json read_baseline(const std::string& file, const Json& report,
                   std::span<const std::string> backends, std::span<const double> frames);

struct BaselineComparison {
    /// The medians and spreads of both runs side by side, and the stages that became slower.
    std::string text;
    /// The last line of the text.
    std::string verdict;
    bool is_slower = false;
};

/// Requires both to have the same frames and backends.
BaselineComparison compare_with_baseline(const std::string& file, const Json& baseline,
                                         const Json& report, double tolerance_percent);

}  // namespace mray::app
