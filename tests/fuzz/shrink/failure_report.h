// Reports a failure: shrinks it, writes it to files and prints it.
#pragma once

#include <filesystem>
#include <string>

#include "tests/fuzz/judge/referee.h"

namespace mray::fuzz {

struct FailureConfig {
    /// Where failures are written, a folder for each.
    std::filesystem::path out = "out/fuzz";
    /// The program with which their command lines are tried.
    std::filesystem::path program;
    /// Print a line for each failure only.
    bool only_list = false;
};

/// Prints the failure to stdout. Unless config.only_list is set, first shrinks it for the variant
/// of its first finding and writes it into a folder `name`.
void report_failure(const FailureConfig& config, const FuzzCase& fuzz_case,
                    std::span<const Finding> findings, const std::string& name, Referee& referee);

}  // namespace mray::fuzz
