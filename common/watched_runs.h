// Work in runs, which end when its caller cancels it.
#pragma once

#include <algorithm>
#include <optional>

#include "common/base/watch.h"
#include "common/frame_times.h"

namespace mray {

/// Calls `work(first, count)` for runs of at most `most` of [begin, end), until the watch is
/// cancelled. If it can be and `least` > 0, runs begin with `least` and then take some ms.
template <class Work>
void for_watched_runs(std::size_t begin, std::size_t end, const Watch& watch, std::size_t most,
                      std::size_t least, Work work) {
    constexpr double kWantedMs = 4;
    const bool is_timed = least != 0 && watch.can_cancel();
    for (std::size_t size = is_timed ? least : most; begin < end && !watch.is_cancelled();) {
        const std::size_t count = std::min(size, end - begin);
        std::optional<Stopwatch> clock;
        if (is_timed) clock.emplace();
        work(begin, count);
        begin += count;
        if (!clock) continue;
        const double wanted = static_cast<double>(count) * kWantedMs / std::max(clock->ms(), 1e-3);
        size = std::clamp(static_cast<std::size_t>(wanted), least, most);
    }
}

}  // namespace mray
