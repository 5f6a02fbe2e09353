// Where the time of a frame goes, and a clock.
#pragma once

#include <chrono>
#include <cstdint>

namespace mray {

/// Milliseconds that bringing a tree to the next pose takes; a part that did not happen is 0.
struct UpdateTimes {
    double upload_ms = 0;  // positions and trees to a backend, or between backends
    double refit_ms = 0;
    double decide_ms = 0;  // finding the cost ratio, and the policy's decision
    double restructure_ms = 0;
    double rebuild_ms = 0;

    double total_ms() const {
        return upload_ms + refit_ms + decide_ms + restructure_ms + rebuild_ms;
    }
    UpdateTimes& operator+=(const UpdateTimes& other) {
        upload_ms += other.upload_ms;
        refit_ms += other.refit_ms;
        decide_ms += other.decide_ms;
        restructure_ms += other.restructure_ms;
        rebuild_ms += other.rebuild_ms;
        return *this;
    }
};

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
