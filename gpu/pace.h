// Sizes of submissions that leave time to ask whether to go on.
#pragma once

#include <algorithm>
#include <cstdint>

namespace mray::gpu {

/// Finds how much work a device does in some tens of milliseconds, whatever its speed. A submission
/// cannot be interrupted.
class Pace {
public:
    explicit Pace(std::uint32_t first) : amount_(first) {}

    /// The amount for the next submission, from 1 to `most`.
    std::uint32_t next(std::uint32_t most) const { return std::clamp(amount_, 1u, most); }

    /// Notes that a submission of this amount took so long.
    void took(std::uint32_t amount, double ms) {
        constexpr double kWantedMs = 40;
        // A time says little about larger amounts: parts of an image differ.
        constexpr double kMostGrowth = 4;
        const double factor = std::clamp(kWantedMs / std::max(ms, 1e-3), 0.0, kMostGrowth);
        constexpr double kMost = 1u << 30;
        amount_ = static_cast<std::uint32_t>(std::clamp(amount * factor, 1.0, kMost));
    }

private:
    std::uint32_t amount_;
};

}  // namespace mray::gpu
