// Other tracers that ours are compared with.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "lab/bench/interleave.h"
#include "lab/bench/trace_work.h"

namespace mray::bench {

/// A way to trace a work. Of a group the fastest makes a row.
struct Peer {
    std::string name;
    std::string group;
    /// One ray a call: compared with ours that do so, and with streams.
    bool one_ray = false;
    /// Runs in the calling thread's arena.
    std::function<void(const WorkPart&)> trace;
    /// The answers of the last trace of each part. Peers may have records in common, which hold
    /// those of the last one.
    std::function<TraceAnswers()> answers;
};

/// Returns the indices of the `count` peers of each group with the least times; groups are in the
/// order of their first peers.
std::vector<std::size_t> fastest_of_groups(std::span<const Peer> peers,
                                           std::span<const Times> times, std::size_t count);

}  // namespace mray::bench
