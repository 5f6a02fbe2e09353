// What became of a clip under several policies, as text.
#pragma once

#include <string>

#include "app/report/reports.h"
#include "common/base/table.h"

namespace morphray::app {

/// A row for each policy and backend.
Table policy_table(const PolicyReport& report);

/// The frames' stages in Chrome's trace format (chrome://tracing, Perfetto): a process for each
/// backend, a thread for each policy, times laid end to end.
std::string trace_events(const PolicyReport& report);

}  // namespace morphray::app
