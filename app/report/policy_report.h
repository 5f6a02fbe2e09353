// The results of `profile --policies`, as text and JSON.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/report/report_head.h"
#include "common/report/table.h"
#include "scenes/policy_runs.h"

namespace mray::app {

/// A clip under several policies on each backend.
struct PolicyReport {
    ReportHead head;
    std::string rays;
    int repeat = 0;
    std::vector<PolicyComparison> backends;
};

/// A row for each round of a policy, to be written while rounds are played. At most 100 columns.
class RoundLines {
public:
    RoundLines(std::span<const PolicySpec> policies, int repeat);
    /// The names of the columns, after a line that says what they mean.
    std::string header() const;
    std::string row(int round, const PolicyRun& run) const;

private:
    std::vector<Column> columns_;
};

/// A row for each policy and backend, and one for the best schedule of each backend; below them
/// what regret is against. At most 100 columns.
std::string policy_text(const PolicyReport& report);
std::string to_json(const PolicyReport& report);

}  // namespace mray::app
