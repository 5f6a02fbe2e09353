// Worker processes. The environment sets the width of lavapipe's vectors, so each width needs a
// process of its own; and a process that crashes does not end the others.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tests/fuzz/judge/referee.h"

namespace mray::fuzz {

struct Worker {
    /// The worker takes every count-th case, starting with this one.
    std::uint32_t index = 0;
    std::uint32_t count = 1;
    bool vulkan = false;
    /// Width of lavapipe's vectors in bits; 0 leaves it to the environment.
    int width = 0;

    /// "cpu" or "vulkan-256".
    std::string name() const;
};

/// `jobs` workers of the CPU, or one for each of the widths 128, 256 and 512 of a Vulkan device
/// that is not refused with it.
std::vector<Worker> make_workers(bool vulkan, std::uint32_t jobs);

/// The state of a worker, in memory that all processes share.
struct WorkerState {
    Tally tally;
    /// The current case, for a message if the worker crashes.
    std::uint64_t current = 0;
};

/// The results of all workers.
struct WorkersResult {
    Tally tally;
    /// Workers that crashed or ended with an error of their own, one line each. Those tell
    /// themselves what is wrong.
    std::vector<std::string> accidents;
    /// The largest exit code of a worker that did not crash.
    int exit_code = 0;
};

/// Runs each worker in a process and waits for all. `failures` counts what all workers have found
/// so far. `work` returns an exit code.
using WorkerTask =
    std::function<int(const Worker&, WorkerState&, std::atomic<std::uint64_t>& failures)>;
WorkersResult run_workers(const std::vector<Worker>& workers, const WorkerTask& work);

}  // namespace mray::fuzz
