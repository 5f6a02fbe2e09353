#include "common/update/policy/loss_account.h"

#include <algorithm>

namespace mray {
namespace {

// The largest backoff: a scene that changes its ways is noticed once this many times the price is
// lost.
constexpr double kMaxBackoff = 16;

}  // namespace

bool LossAccount::is_due(double loss, double price) const {
    if (loss <= 0) return false;
    // In whole frames, both rules count half of the frame to come.
    const double lost = lost_ + loss / 2;
    const double threshold = backoff_ * price;
    return (frames_ + 1) * loss - lost >= threshold || lost >= threshold;
}

double LossAccount::add(double loss) {
    frames_ += 1;
    lost_ += loss;
    saved_ += loss_before_ - loss;
    last_loss_ = loss;
    return std::max(0.0, loss_before_ - loss);
}

void LossAccount::start_over(double price) {
    if (loss_before_ > 0) {
        const bool paid = saved_ >= price / 2;
        backoff_ = std::clamp(paid ? backoff_ / 2 : backoff_ * 2, 1.0, kMaxBackoff);
    }
    loss_before_ = last_loss_;
    frames_ = lost_ = saved_ = 0;
}

}  // namespace mray
