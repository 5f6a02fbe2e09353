// Processes that try cases. The environment sets the width of lavapipe's vectors, so each width
// needs a process of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace mray::fuzz {

struct Process {
    bool vulkan = false;
    /// Width of lavapipe's vectors in bits.
    int width = 0;
    /// The process takes every count-th case, starting with this one.
    std::uint32_t index = 0;
    std::uint32_t count = 1;
    /// The current case, in memory that the caller of run_processes() sees, too.
    std::uint64_t* current = nullptr;

    /// "cpu" or "vulkan-256".
    std::string name() const;
};

/// One process of the CPU, or one for each of the widths 128, 256 and 512 that is not refused.
/// Runs all and waits. Prints which case was tried when one crashed. Returns the largest exit code.
int run_processes(bool vulkan, const std::function<int(const Process&)>& work);

}  // namespace mray::fuzz
