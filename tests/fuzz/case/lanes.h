// Processes side by side. The width of lavapipe's vectors is a matter of the environment, so each
// width needs a process; and one that crashes ends without the others.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/fuzz/judge/referee.h"

namespace morphray::fuzz {

struct Lane {
    /// Takes every count-th case, from this one.
    std::uint32_t index = 0;
    std::uint32_t count = 1;
    bool vulkan = false;
    /// Of lavapipe's vectors, in bits; 0 leaves it to the environment.
    int width = 0;

    /// "cpu" or "vulkan-256".
    std::string name() const;
};

/// `jobs` lanes of the CPU, or one for each width of a Vulkan device, which are 128, 256 and 512.
std::vector<Lane> make_lanes(bool vulkan, std::uint32_t jobs);

/// What a lane tells the others, in memory that they share.
struct LaneState {
    Tally tally;
    /// What it is at, for the case that it crashes.
    std::uint64_t current = 0;
};

/// Of all lanes.
struct LanesResult {
    Tally tally;
    /// Lanes that crashed or ended with an error of their own, one line each. Those tell themselves
    /// what is wrong.
    std::vector<std::string> accidents;
    /// The largest exit code of a lane that ended by itself.
    int exit_code = 0;
};

/// Runs each lane in a process and waits for all. `failures` counts what all lanes have found so
/// far. `work` returns an exit code.
using LaneWork = std::function<int(const Lane&, LaneState&, std::atomic<std::uint64_t>& failures)>;
LanesResult run_lanes(const std::vector<Lane>& lanes, const LaneWork& work);

}  // namespace morphray::fuzz
