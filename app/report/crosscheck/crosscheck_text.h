// A cross-check as text for people.
#pragma once

#include <string>

#include "app/base/options.h"
#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// The first differing pixels of a comparison with both values, exactly, and for each the commands
/// that trace it as the reference and as the variant. `build_at` is the frame that the refitted
/// tree was built at.
std::string describe_row(const Options& options, const CheckRow& row, double build_at);

/// "frame 3, vulkan, rebuild, against brute: 3 rays differ in all hits".
std::string query_text(const QueryRow& row);

/// A line for each variant, one for each image, each pair of trees and each set of answers that
/// differ.
std::string table_text(const CheckReport& report);

/// "all 12 comparisons are equal bit by bit", or how many differ.
std::string summary_text(const CheckReport& report);

/// Everything about the scenes, one after the other; nothing about a scene that was not begun.
std::string run_text(const Options& options, const CheckRun& run);

}  // namespace mray::app
