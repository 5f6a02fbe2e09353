// What a tree has cost since it was made, and whether a remedy is worth its price.
#pragma once

namespace morphray {

/// Each frame loses x_i to a tree that is no longer what it was; a remedy costs P and makes the
/// loss start again from 0. Two rules for when it is time, with x_1 ... x_K the losses since the
/// last remedy:
///
/// - *Due*: K x_K - (x_1 + ... + x_K) >= P. If the next tree rots like this one did, the mean cost
///   of a frame, (P + x_1 + ... + x_K) / K, is least where the loss has grown to that mean (the
///   economic life of equipment: J. Taylor. A statistical theory of depreciation. 1923). A loss
///   that was there at once and does not grow is never due: a new tree would soon be as bad.
/// - *Overdue*: x_1 + ... + x_K >= P. In case the next tree does not degrade like this one:
/// whatever
///   comes, this pays at most twice what hindsight would (ski rental: R. Karp. On-line algorithms
///   versus off-line algorithms. 1992).
///
/// For losses that grow evenly both say the same. A remedy that has not saved half its price by the
/// time of the next one doubles the backoff, a factor before P; one that has halves it, down to 1.
/// That, and the memory of all losses since, is the hysteresis.
class LossAccount {
public:
    /// Whether it is time in a frame that is going to lose `loss`. Loss and price in any one unit.
    bool is_due(double loss, double price) const;
    void add(double loss);
    /// The remedy has been applied, for this price.
    void start_over(double price);

    double lost() const { return lost_; }
    double backoff() const { return backoff_; }

private:
    double frames_ = 0;
    double lost_ = 0;
    double last_loss_ = 0;
    /// What a frame lost before the last remedy, and what that has saved by this measure.
    double loss_before_ = 0;
    double saved_ = 0;
    double backoff_ = 1;
};

}  // namespace morphray
