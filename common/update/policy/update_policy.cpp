#include "common/update/policy/update_policy.h"

#include <fmt/format.h>

#include <cassert>

#include "common/update/policy/auto_policy.h"

namespace mray {
namespace {

class AlwaysRefit final : public UpdatePolicy {
public:
    UpdateDecision plan() override { return {UpdateStep::kRefit, "asked for"}; }
};

class AlwaysRebuild final : public UpdatePolicy {
public:
    UpdateDecision plan() override { return {UpdateStep::kRebuild, "asked for"}; }
};

class EveryFrames final : public UpdatePolicy {
public:
    explicit EveryFrames(std::uint32_t period) : period_(period) { assert(period >= 1); }

    UpdateDecision plan() override {
        ++age_;
        if (age_ < period_) {
            return {UpdateStep::kRefit, fmt::format("frame {} of {}", age_, period_)};
        }
        age_ = 0;
        return {UpdateStep::kRebuild, fmt::format("each {} frames", period_)};
    }

private:
    std::uint32_t period_;
    std::uint32_t age_ = 0;
};

}  // namespace

std::unique_ptr<UpdatePolicy> make_update_policy(const PolicySpec& policy,
                                                 const UpdateConfig& config) {
    switch (policy.kind) {
        case PolicyKind::kRefit:
            return std::make_unique<AlwaysRefit>();
        case PolicyKind::kRebuild:
            return std::make_unique<AlwaysRebuild>();
        case PolicyKind::kEvery:
            return std::make_unique<EveryFrames>(policy.period);
        default:
            return std::make_unique<AutoPolicy>(config);
    }
}

}  // namespace mray
