#include "app/view/strips.h"

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
    std::erase_if(events_, [&](const Event& e) { return e.seconds < seconds - kWindow; });
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

}  // namespace mray::app
