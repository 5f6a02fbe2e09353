// Shrinks and reports cases of calls that fail.
#pragma once

#include <functional>
#include <string>

#include "tests/fuzz/judge/call_check.h"
#include "tests/fuzz/shrink/failure_report.h"

namespace mray::fuzz {

/// Returns a failing case from which no call can be removed, and in which no number can be less
/// (1, a half, one less).
FuzzCase shrink_calls(const FuzzCase& failing, const std::function<bool(const FuzzCase&)>& fails);

/// "call 3 (rays, scene 0): closest hits, number 5 of 60: ..."
std::string describe(const CallDifference& difference, const FuzzCase& fuzz_case);

/// Prints the failure on these devices to stdout. Unless config.only_list is set, first shrinks it
/// and writes it into a folder `name`.
void report_call_failure(const FailureConfig& config, const FuzzCase& fuzz_case,
                         const CallDifference& difference, const CallDevices& devices,
                         const std::string& name);

}  // namespace mray::fuzz
