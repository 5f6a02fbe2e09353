// A comparison of policies for chrome://tracing and Perfetto.
#pragma once

#include <string>

#include "app/report/policy_report.h"

namespace mray::app {

/// The stages of all frames in Chrome's trace format (Trace Event Format, Google 2016): a process
/// for each backend, a thread for each policy, the stages of a thread end to end.
std::string trace_events(const PolicyReport& report);

}  // namespace mray::app
