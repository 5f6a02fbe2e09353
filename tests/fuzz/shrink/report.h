// Reports a failure: shrinks it, writes it to a file and prints it.
#pragma once

#include <filesystem>
#include <string>

#include "tests/fuzz/judge/referee.h"

namespace mray::fuzz {

struct FailureName {
    /// The folder for a folder of each failure.
    std::filesystem::path out;
    /// The kind of the case and its seed.
    std::string name;
    bool is_on_vulkan = false;
};

/// Shrinks the failure for the variant of the finding, writes it as text and
/// prints it with the line that replays it. Throws Error(kOutput).
void report_failure(const FailureName& name, const FuzzCase& fuzz_case, const Finding& finding,
                    Referee& referee);

}  // namespace mray::fuzz
