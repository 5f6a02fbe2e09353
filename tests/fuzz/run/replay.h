// Replays cases from files, such as the corpus.
#pragma once

#include <string>
#include <vector>

#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/run/process.h"

namespace mray::fuzz {

/// A file and the case that it holds.
struct NamedCase {
    std::string name;
    FuzzCase fuzz_case;
};

/// Throws Error(kBadInput) for a file that is not a case.
std::vector<NamedCase> read_cases(const std::vector<std::string>& files);

/// Traces every case on every variant of the process. Prints the differences. Returns an exit
/// code.
int run_replay(const std::vector<NamedCase>& cases, const Process& process);

}  // namespace mray::fuzz
