// Measures wall time.
#pragma once

#include <chrono>

namespace mray {

/// Starts when it is constructed.
class Stopwatch {
public:
    double ms() const {
        const auto elapsed = std::chrono::steady_clock::now() - start_;
        return std::chrono::duration<double, std::milli>(elapsed).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace mray
