// How much of a machine other programs take.
#pragma once

#include <optional>

namespace mray {

/// Watches the cores that this process may use, from its construction on.
class MachineLoad {
public:
    MachineLoad();

    /// The part of the time of these cores that other programs, the system and hypervisors have
    /// taken since, 0 to 1. 0 where the system does not tell (/proc/stat of Linux), and for less
    /// than a few of its ticks of some 10 ms.
    double others() const;

private:
    struct Times {
        /// Milliseconds of all cores together.
        double busy = 0;
        double all = 0;
        /// That of this process.
        double own = 0;
    };
    static std::optional<Times> now();

    std::optional<Times> start_;
};

}  // namespace mray
