// Measurements of the last images, as strips over time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/view/image_request.h"

namespace mray::app {

/// One image that an update preceded.
struct StripSample {
    float update_ms = 0;
    float trace_ms = 0;
    float cost_ratio = 1;
    morphray::Step step = morphray::Step::keep;
};

/// The newest samples, oldest first.
class Strips {
public:
    static constexpr std::size_t kLength = 240;

    /// Adds the first backend's sample of an image with an update.
    void add(const TracedImage& image);
    std::span<const StripSample> samples() const { return samples_; }

private:
    std::vector<StripSample> samples_;
};

/// Events a second over the last second or so.
class RateMeter {
public:
    /// Something has happened at a time in seconds, which never goes back; `amount` counts for it.
    void add(double seconds, double amount = 1);
    /// The amount a second between the first and the last event that are younger than a second; 0
    /// for fewer than two.
    double rate(double seconds) const;
    /// As above; for fewer than two by the time between the last two events, or since the last one
    /// if that is longer. 0 before there are two.
    double slow_rate(double seconds) const;

private:
    struct Event {
        double seconds = 0;
        double amount = 0;
    };
    std::vector<Event> events_;
};

/// "12.3 images/s"; "still" if nothing has happened lately and nothing moves; "0.25 images/s" for
/// less than one.
std::string rate_text(double rate, bool moves, const char* unit);

}  // namespace mray::app
