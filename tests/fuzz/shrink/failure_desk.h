// What becomes of a failure: it is made small, written down, and told.
#pragma once

#include <filesystem>
#include <string>

#include "tests/fuzz/judge/referee.h"

namespace morphray::fuzz {

struct FailureConfig {
    /// Where failures are written, a folder for each.
    std::filesystem::path out = "out/fuzz";
    /// The program that their lines are tried with.
    std::filesystem::path program;
    /// Only told in a line each.
    bool only_list = false;
};

/// Prints the failure on stdout; unless it is only listed, shrinks it first for the entrant of its
/// first finding, and writes it into a folder `name`.
void report_failure(const FailureConfig& config, const FuzzCase& fuzz_case,
                    std::span<const Finding> findings, const std::string& name, Referee& referee);

}  // namespace morphray::fuzz
