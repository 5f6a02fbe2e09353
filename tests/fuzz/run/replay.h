// Cases from files: the corpus.
#pragma once

#include <string>
#include <vector>

#include "tests/fuzz/case/lanes.h"

namespace morphray::fuzz {

/// A file and the case that it holds.
struct NamedCase {
    std::string name;
    FuzzCase fuzz_case;
};

/// Throws Error(kBadInput) for a file that is no case.
std::vector<NamedCase> read_cases(const std::vector<std::string>& files);

/// Every case on every entrant of the lane, whichever lane it is. Prints a line for each that
/// differs, and where. Returns an exit code.
int run_replay(const std::vector<NamedCase>& cases, const Lane& lane, LaneState& state,
               std::atomic<std::uint64_t>& failures);

}  // namespace morphray::fuzz
