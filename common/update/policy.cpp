#include "common/update/policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "common/base/errors.h"
#include "common/text/text.h"

namespace mray {
namespace {

constexpr std::string_view kEvery = "every:";

/// Rebuilds in each frame whose number is a multiple of the period; never if that is 0.
class PeriodicPolicy final : public UpdatePolicy {
public:
    explicit PeriodicPolicy(std::uint32_t period) : period_(period) {}

    UpdateDecision plan() override {
        if (period_ == 0 || ++age_ < period_) return {UpdateStep::kRefit, "asked for"};
        age_ = 0;
        return {UpdateStep::kRebuild, "asked for"};
    }

private:
    std::uint32_t period_;
    std::uint32_t age_ = 0;
};

/// The losses of a tree since its last remedy, and whether the next one is worth its price
/// (docs/design/updates.md). It is due when the mean cost of a frame is least (the economic life of
/// equipment: J. Taylor. A statistical theory of depreciation. 1923), or when as much is lost (ski
/// rental: R. Karp. On-line algorithms versus off-line algorithms. 1992). A remedy halves a factor
/// of the price if it has saved half of that before the next remedy, and doubles it otherwise.
class LossAccount {
public:
    /// Whether a remedy is due in a frame that is going to lose `loss`, in the unit of the price.
    bool is_due(double loss, double price) const {
        if (loss <= 0) return false;
        // In whole frames, both rules count half of the frame to come.
        const double lost = lost_ + loss / 2;
        const double threshold = price_factor_ * price;
        return (frames_ + 1) * loss - lost >= threshold || lost >= threshold;
    }

    /// Ends a frame. Returns what the last remedy has saved in it, or 0.
    double add(double loss) {
        frames_ += 1;
        lost_ += loss;
        saved_ += loss_before_ - loss;
        last_loss_ = loss;
        return std::max(0.0, loss_before_ - loss);
    }

    void start_over(double price) {
        // A scene that changes its ways is noticed once this many times the price is lost.
        constexpr double kMostPriceFactor = 16;
        if (loss_before_ > 0) {
            const bool paid = saved_ >= price / 2;
            price_factor_ =
                std::clamp(paid ? price_factor_ / 2 : price_factor_ * 2, 1.0, kMostPriceFactor);
        }
        loss_before_ = last_loss_;
        frames_ = lost_ = saved_ = 0;
    }

private:
    double frames_ = 0;
    double lost_ = 0;
    double last_loss_ = 0;
    /// The loss of a frame before the last remedy, and the savings since, compared with it.
    double loss_before_ = 0;
    double saved_ = 0;
    double price_factor_ = 1;
};

/// A trace takes 1 + per_visit * overhead times as long as that of a sound tree. The factor depends
/// on scene, view and tracer. So it is estimated by least squares over the overhead and the times
/// of replaced trees, with more weight for recent ones. A guess with a weight of its own is added
/// to them; the traces of the present tree, as it degrades, correct the guess.
class SlowdownModel {
public:
    explicit SlowdownModel(double first_per_visit) { guess(first_per_visit); }

    void guess(double per_visit) {
        first_per_visit_ = per_visit;
        first_weight_ = kFirstWeight / per_visit * (kFirstWeight / per_visit);
    }

    double slowdown(double overhead) const {
        const double per_visit =
            (first_weight_ * first_per_visit_ + watched_weight_ * watched_ + weighted_) /
            (first_weight_ + watched_weight_ + weight_);
        return 1 + per_visit * overhead;
    }

    /// Learns from a replaced tree: a trace of `trace_before` at `overhead_before`, and of
    /// `trace_after` in the next frame with the new tree at `overhead_after`. From
    /// trace_before / trace_after = (1 + p a) / (1 + p b) follows times - 1 = p (a - times b).
    void learn(double overhead_before, double trace_before, double overhead_after,
               double trace_after) {
        if (!(trace_before > 0) || !(trace_after > 0) || !(overhead_before > overhead_after))
            return;
        const double times = std::max(1.0, trace_before / trace_after);
        const double x = std::max(overhead_before - overhead_after * times, 0.0);
        const double y = std::min(times - 1, kMostPerVisit * first_per_visit_ * x);
        weight_ = kMemory * weight_ + x * x;
        weighted_ = kMemory * weighted_ + x * y;
    }

    /// Learns from a frame of the tree in use: weaker evidence, since the image changes, too.
    void watch(double overhead, double trace) {
        if (!(trace > 0)) return;
        if (first_trace_ <= 0) {
            first_trace_ = trace;
            first_overhead_ = overhead;
            return;
        }
        const double times = trace / first_trace_;
        const double x = overhead - first_overhead_ * times;
        const double weight = std::min(x * x, kMostWatched * first_weight_);
        if (!(x > 0) || weight < watched_weight_) return;
        watched_weight_ = weight;
        watched_ = std::clamp((times - 1) / x, 0.0, kMostPerVisit * first_per_visit_);
    }
    /// Makes the next watch() the first one of a new tree.
    void forget_watched() { first_trace_ = 0; }

private:
    // The guess weighs as much as one tree that was replaced at this slow-down beyond 1.
    static constexpr double kFirstWeight = 0.1;
    // The part of its weight that an observation keeps when the next one comes.
    static constexpr double kMemory = 0.8;
    // A time that was disturbed must not teach more than this times the guess, or less than 0.
    static constexpr double kMostPerVisit = 20;
    // The guess has to stay above 0: an image that becomes easier would hide a degraded tree.
    static constexpr double kMostWatched = 2;

    double first_per_visit_;
    double first_weight_;
    double weight_ = 0;
    double weighted_ = 0;
    /// Overhead and time of the first frame of the present tree; a time of 0 before it.
    double first_overhead_ = 0;
    double first_trace_ = 0;
    double watched_weight_ = 0;
    double watched_ = 0;
};

// An overhead visit prolongs a trace of single rays by this many times what it adds to packets
// (lab/notes/updates.md).
constexpr double kSingleRays = 10;
// Up to this loss a tree counts as sound: the model is no more exact than that.
constexpr double kSound = 0.01;
// The assumed cost of a build before any trace was timed, in traces of a sound tree.
constexpr double kFirstPrice = 0.5;
// The part of each frame's refit and trace that may be invested.
constexpr double kInvested = 0.05;
// Whatever the budget: a tree that is older when it is shown is no better than the one before.
constexpr double kMostBuildFrames = 64;
// A first restructuring is taken to cost this part of a build, the next one this part of the last:
// the first takes apart every leaf that straddles two bodies, later ones find most of that done.
constexpr double kFirstRestructureCost = 0.4;
constexpr double kNextRestructureCost = 0.5;
// A restructured triangle costs this many of a build: nodes around it are laid out again.
constexpr double kRestructuredTriangle = 2;
// A restructuring that takes away less than this part of the overhead did not help.
constexpr double kHelpful = 0.3;
constexpr int kLongestWait = 64;
// Each build in the background makes the measured price less certain, down to a part of it, so that
// a build that is little over the budget is tried in a frame again.
constexpr double kFading = 0.9;
constexpr double kFaded = 0.7;

/// Refits; restructures degraded parts and rebuilds when that pays (docs/design/updates.md). Losses
/// are those that the overhead visits of the tree explain (SlowdownModel), in times of a sound
/// tree: measured times change with the image.
class AutoPolicy final : public UpdatePolicy {
public:
    explicit AutoPolicy(const UpdateConfig& config)
        : config_(config), model_(config.first_per_visit) {}

    bool needs_tree_cost() const override { return true; }
    void built(double cost) override { build_cost_ = measured_build_cost_ = cost; }

    UpdateDecision plan() override { return {UpdateStep::kRefit, "a refit comes first"}; }

    UpdateDecision review(const RefittedTree& tree) override {
        const std::string known = fmt::format("{:.1f} overhead visits, a frame loses {:.1f} %",
                                              tree.overhead, 100 * loss(tree.overhead));
        if (tree.restructured) rate_restructuring(tree.overhead);
        if (loss(tree.overhead) == 0) return {UpdateStep::kRefit, "sound: " + known};
        // No account knows before the next trace what a remedy has changed.
        const bool is_new = tree.new_tree || untraced_.new_tree;
        if (!tree.restructured && !is_new && untraced_.restructure == 0 &&
            should_restructure(tree.overhead)) {
            overhead_before_ = tree.overhead;
            return {.step = UpdateStep::kRestructure,
                    .reason = "restructuring pays: " + known,
                    .most_restructured = frame_budget() / (kRestructuredTriangle * build_cost_)};
        }
        const double now = residual(tree.overhead);
        if (now >= build_price()) return {UpdateStep::kRebuild, "pays at once: " + known};
        if (is_new) return {UpdateStep::kRefit, "a new tree: " + known};
        if (tree.build_pending)
            return {UpdateStep::kRefit, "a build runs in the background: " + known};
        if (investments_ < build_cost_ || !builds_.is_due(now, build_price()))
            return {UpdateStep::kRefit, "not yet due: " + known};
        if (build_cost_ <= frame_budget()) return {UpdateStep::kRebuild, "due: " + known};
        const double frames = std::min(std::ceil(build_cost_ / frame_budget()), kMostBuildFrames);
        return {UpdateStep::kRebuildInBackground, "due, and over the budget: " + known,
                static_cast<std::uint32_t>(frames)};
    }

    void frame_done(const FrameCost& update) override {
        if (update.rebuild > 0) {
            build_cost_ = measured_build_cost_ = update.rebuild;
        } else if (update.new_tree) {
            build_cost_ = std::max(kFading * build_cost_, kFaded * measured_build_cost_);
        }
        if (update.restructure > 0) restructure_cost_ = update.restructure;
        // Updates that nothing traces belong to the frame of the next trace.
        untraced_ = {.refit = untraced_.refit + update.refit,
                     .restructure = untraced_.restructure + update.restructure,
                     .rebuild = untraced_.rebuild + update.rebuild,
                     .trace = update.trace,
                     .single_part = update.single_part,
                     .overhead = update.overhead,
                     .new_tree = untraced_.new_tree || update.new_tree,
                     .build_pending = untraced_.build_pending || update.build_pending};
        if (update.trace <= 0) return;
        const FrameCost cost = std::exchange(untraced_, {});
        model_.guess(config_.first_per_visit * (1 + (kSingleRays - 1) * cost.single_part));
        frame_cost_ = cost.refit + cost.trace;
        if (cost.new_tree || cost.restructure > 0) {
            model_.learn(overhead_, trace_, cost.overhead, cost.trace);
            model_.forget_watched();
            restructurings_.start_over(restructure_price());
        }
        if (cost.new_tree) {
            builds_.start_over(build_price());
            floor_ = 0;
        }
        balance_investments(cost);
        wait_ = std::max(0, wait_ - 1);
        if (cost.build_pending) return;
        remember_trace(cost.trace / model_.slowdown(cost.overhead));
        model_.watch(cost.overhead, cost.trace);
        trace_ = cost.trace;
        overhead_ = cost.overhead;
    }

private:
    /// The loss of a frame by a tree with this overhead, in traces of a sound tree.
    double loss(double overhead) const {
        const double lost = model_.slowdown(overhead) - 1;
        return lost <= kSound ? 0 : lost;
    }

    /// The part of the loss that only a build can cure.
    double residual(double overhead) const {
        return loss(wait_ > 0 || traces_ == 0 ? overhead : std::min(overhead, floor_));
    }

    /// The time that an investment may add to refit and trace of a frame.
    double frame_budget() const {
        return config_.budget_ms > 0 ? config_.budget_ms : config_.budget * frame_cost_;
    }

    double restructure_cost() const {
        const double whole = restructure_cost_ > 0 ? kNextRestructureCost * restructure_cost_
                                                   : kFirstRestructureCost * build_cost_;
        return std::min(whole, frame_budget());
    }

    /// Costs in traces of a sound tree.
    double build_price() const {
        if (traces_ > 0) return build_cost_ / sound_trace_;
        return untraced_.rebuild > 0 ? std::numeric_limits<double>::infinity() : kFirstPrice;
    }
    double restructure_price() const { return restructure_cost() / sound_trace_; }

    bool should_restructure(double overhead) const {
        if (wait_ > 0 || traces_ == 0) return false;
        const double avoidable = loss(overhead) - residual(overhead);
        const double price = restructure_price();
        return avoidable >= price ||
               (investments_ >= restructure_cost() && restructurings_.is_due(avoidable, price));
    }

    void rate_restructuring(double overhead) {
        const bool helped = overhead_before_ - overhead >= kHelpful * overhead_before_;
        next_wait_ = helped ? next_wait_ / 2 : std::clamp(2 * next_wait_, 1, kLongestWait);
        wait_ = helped ? 0 : next_wait_;
        floor_ = overhead;
    }

    void remember_trace(double sound_trace) {
        last_traces_[traces_++ % last_traces_.size()] = sound_trace;
        std::array<double, 5> traces = last_traces_;
        const auto end =
            traces.begin() + static_cast<std::ptrdiff_t>(std::min(traces_, traces.size()));
        const auto middle = traces.begin() + (end - traces.begin() - 1) / 2;
        std::nth_element(traces.begin(), middle, end);
        sound_trace_ = *middle;
    }

    /// Adds this frame's share and savings, and takes what its remedies cost.
    void balance_investments(const FrameCost& cost) {
        const bool swapped = cost.new_tree && cost.rebuild == 0;
        const double unavoidable = residual(cost.overhead);
        const double saved =
            builds_.add(unavoidable) + restructurings_.add(loss(cost.overhead) - unavoidable);
        investments_ += kInvested * (cost.refit + cost.trace) + saved * sound_trace_;
        investments_ -= cost.rebuild + cost.restructure + (swapped ? build_cost_ : 0);
    }

    UpdateConfig config_;
    SlowdownModel model_;
    LossAccount builds_;
    LossAccount restructurings_;
    /// Time that may be spent on investments; below 0 after a remedy that has not yet paid.
    double investments_ = 0;
    double build_cost_ = 0;
    double measured_build_cost_ = 0;
    /// 0 before the first.
    double restructure_cost_ = 0;
    /// The median of the last traces, each divided by its slow-down. Before the first trace
    /// nothing is restructured, and one update may rebuild, at kFirstPrice.
    double sound_trace_ = 0;
    FrameCost untraced_ = {};
    std::array<double, 5> last_traces_ = {};
    std::size_t traces_ = 0;
    double frame_cost_ = 0;
    /// Time and overhead of the last trace that no background build disturbed.
    double trace_ = 0;
    double overhead_ = 0;
    /// The overhead right after the last build or restructuring, which that could not cure.
    double floor_ = 0;
    double overhead_before_ = 0;
    /// Frames to wait after a restructuring that did not help; it doubles each time.
    int next_wait_ = 0;
    int wait_ = 0;
};

}  // namespace

std::span<const std::string> policy_forms() {
    // In the order of PolicyKind.
    static const std::array<std::string, 4> forms = {"refit", "rebuild", "every:K", "auto"};
    return forms;
}

std::string text_of(const PolicySpec& policy) {
    if (policy.kind == PolicyKind::kEvery) return fmt::format("{}{}", kEvery, policy.period);
    return policy_forms()[static_cast<std::size_t>(policy.kind)];
}

PolicySpec parse_policy(const std::string& text) {
    if (text.starts_with(kEvery)) {
        const auto period = parse_integer(std::string_view(text).substr(kEvery.size()));
        if (period && *period >= 1 && *period <= static_cast<long long>(kMostPeriod))
            return {PolicyKind::kEvery, static_cast<std::uint32_t>(*period)};
    }
    for (const PolicyKind kind : {PolicyKind::kRefit, PolicyKind::kRebuild, PolicyKind::kAuto})
        if (text == text_of({kind})) return {kind};
    throw Error(ErrorKind::kBadArgument, fmt::format("{} is not one of {}, with K from 1",
                                                     quote(text), fmt::join(policy_forms(), ", ")));
}

std::unique_ptr<UpdatePolicy> make_update_policy(const PolicySpec& policy,
                                                 const UpdateConfig& config) {
    if (policy.kind == PolicyKind::kAuto) return std::make_unique<AutoPolicy>(config);
    assert((policy.kind == PolicyKind::kEvery) == (policy.period >= 1));
    const bool always = policy.kind == PolicyKind::kRebuild;
    return std::make_unique<PeriodicPolicy>(always ? 1 : policy.period);
}

}  // namespace mray
