// A comparison of policies as a table.
#pragma once

#include "app/report/reports.h"
#include "common/text/table.h"

namespace mray::app {

/// A row for each policy and backend, and one for the best schedule of each backend.
Table policy_table(const PolicyReport& report);

}  // namespace mray::app
