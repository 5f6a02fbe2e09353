#include "app/view/strips.h"

#include <fmt/format.h>

#include <algorithm>

namespace mray::app {
namespace {

constexpr double kWindow = 1;

}  // namespace

void Strips::add(const TracedImage& image) {
    if (image.panes.empty() || !image.panes.front().has_update) return;
    const TracedPane& pane = image.panes.front();
    if (samples_.size() == kLength) samples_.erase(samples_.begin());
    samples_.push_back({static_cast<float>(pane.update_ms),
                        static_cast<float>(pane.trace_ms + pane.shade_ms),
                        static_cast<float>(pane.update.cost_ratio), pane.update.step});
}

void RateMeter::add(double seconds, double amount) {
    // The last one is kept for slow_rate().
    while (events_.size() > 1 && events_.front().seconds < seconds - kWindow)
        events_.erase(events_.begin());
    events_.push_back({seconds, amount});
}

double RateMeter::rate(double seconds) const {
    const auto is_young = [&](const Event& e) { return e.seconds >= seconds - kWindow; };
    const auto first = std::find_if(events_.begin(), events_.end(), is_young);
    if (events_.end() - first < 2) return 0;
    // Leaves out the amount of the first event, which was made before it.
    double amount = 0;
    for (auto e = first + 1; e != events_.end(); ++e) amount += e->amount;
    const double time = events_.back().seconds - first->seconds;
    return time > 0 ? amount / time : 0;
}

double RateMeter::slow_rate(double seconds) const {
    if (const double fast = rate(seconds); fast > 0) return fast;
    if (events_.size() < 2) return 0;
    const Event& last = events_.back();
    const double before = last.seconds - events_[events_.size() - 2].seconds;
    const double time = std::max(before, seconds - last.seconds);
    return time > 0 ? last.amount / time : 0;
}

std::string rate_text(double rate, bool moves, const char* unit) {
    if (rate == 0) return moves ? "..." : "still";
    return fmt::format("{:.{}f} {}", rate, rate < 1 ? 2 : 1, unit);
}

}  // namespace mray::app
