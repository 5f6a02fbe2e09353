// The calls that may be made to fail.
#pragma once

#include <cstdint>

namespace mray::test {

enum FaultKind : int {
    kAllocation,
    kOpen,
    kRead,
    kWrite,
    kSync,
    kLink,
    kRename,
    kThread,
    kVulkan,
    kFaultKinds
};

inline constexpr const char* kFaultNames[kFaultKinds] = {
    "allocation", "open", "read", "write", "sync", "link", "rename", "thread", "vulkan"};

/// How often each was called.
struct FaultCounts {
    std::uint64_t calls[kFaultKinds] = {};
};

}  // namespace mray::test
