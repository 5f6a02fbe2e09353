// A comparison of policies as text.
#pragma once

#include <string>

#include "app/report/reports.h"

namespace mray::app {

/// A row for each policy and backend, and one for the best schedule of each backend; below them
/// what regret is against. At most 100 columns.
std::string policy_text(const PolicyReport& report);

}  // namespace mray::app
