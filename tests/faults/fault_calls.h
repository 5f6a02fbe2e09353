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
    kInput,
    kFaultKinds
};

inline constexpr const char* kFaultNames[kFaultKinds] = {
    "allocation", "open", "read", "write", "sync", "link", "rename", "thread", "vulkan", "input"};

/// "Errors" of kInput: another program changes a file below `in` just before a part of it is read.
enum FileChange : int { kShrinks = -1, kGrows = -2, kIsWritten = -3 };

/// How often each was called.
struct FaultCounts {
    std::uint64_t calls[kFaultKinds] = {};
};

}  // namespace mray::test
