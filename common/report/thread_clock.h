// The processor time of a thread.
#pragma once

#include <ctime>

namespace mray {

/// Milliseconds for which the calling thread has run, by a clock of nanoseconds. The clock of the
/// process (std::clock) advances in ticks of some milliseconds while the process has a limit of
/// processor time.
inline double thread_ms() {
    std::timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

}  // namespace mray
