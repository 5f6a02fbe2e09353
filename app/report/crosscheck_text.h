// A crosscheck in words.
#pragma once

#include <string>

#include "app/cli/options.h"
#include "app/report/reports.h"

namespace morphray::app {

/// The first differing pixels of a comparison with both values, every bit of them, and for each the
/// two commands that trace it as the reference and as the variant did. `build_at` is the frame that
/// the refitted tree was built at.
std::string describe_row(const Options& options, const CheckRow& row, double build_at);

/// A line a comparison, and a line a pair of trees.
std::string table_text(const CheckReport& report);

/// "all 12 comparisons are equal bit by bit" or how many are not.
std::string summary_text(const CheckReport& report);

}  // namespace morphray::app
