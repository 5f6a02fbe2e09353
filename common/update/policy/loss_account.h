// The losses of a tree since it was made, and whether a remedy is worth its price.
#pragma once

namespace mray {

/// Each frame loses x_i to a tree that is no longer what it was; a remedy costs P and makes the
/// loss start again from 0. Two rules for when it is time, with x_1 ... x_K the losses since the
/// last remedy:
///
/// - *Due*: K x_K - (x_1 + ... + x_K) >= P. If the next tree degrades like this one, the mean cost
///   of a frame, (P + x_1 + ... + x_K) / K, is least where the loss has grown to that mean (the
///   economic life of equipment: J. Taylor. A statistical theory of depreciation. 1923). A loss
///   that was there at once and does not grow is never due: a new tree would soon be as bad.
/// - *Overdue*: x_1 + ... + x_K >= P. If the next tree does not degrade like this one, this rule
///   costs at most twice as much as hindsight (ski rental: R. Karp. On-line algorithms versus
///   off-line algorithms. 1992).
///
/// For losses that grow evenly both rules agree. A remedy that has not saved half its price by the
/// time of the next one doubles the backoff, a factor of P; one that has halves it, down to 1. This
/// and the sum of all losses since the last remedy are the hysteresis.
class LossAccount {
public:
    /// Whether a remedy is due in a frame that is going to lose `loss`. Loss and price have the
    /// same unit.
    bool is_due(double loss, double price) const;
    /// Ends a frame. Returns what the last remedy has saved in it: the loss of the frame before
    /// that remedy beyond this loss, or 0.
    double add(double loss);
    /// The remedy has been applied, for this price.
    void start_over(double price);

    double lost() const { return lost_; }
    double backoff() const { return backoff_; }

private:
    double frames_ = 0;
    double lost_ = 0;
    double last_loss_ = 0;
    /// The loss of a frame before the last remedy, and the savings since, compared with it.
    double loss_before_ = 0;
    double saved_ = 0;
    double backoff_ = 1;
};

}  // namespace mray
