// Counts calls, and lets one of them fail: what the preloaded library and the Vulkan layer share.
//
// MORPHRAY_FAULT=KIND:K[:ERROR] lets call K (from 0) of a kind fail with an error, ENOMEM unless
// given. MORPHRAY_FAULT_COUNTS names a file that receives the counts: the program may end without
// destructors, so the file is mapped.
#pragma once

#include "tests/faults/fault_calls.h"

namespace mray::test {

struct Faults {
    FaultCounts own_counts;
    FaultCounts* counts = &own_counts;
    int kind = -1;
    std::uint64_t at = 0;
    /// Whether all later calls fail, too.
    bool lasts = false;
    int error = 0;
};

/// Read from the environment before the constructors of libraries that are not preloaded run.
extern Faults faults;

/// Counts a call. Returns whether it fails, with errno set.
bool fails(FaultKind kind);

}  // namespace mray::test
