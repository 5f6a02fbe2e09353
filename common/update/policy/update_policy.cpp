#include "common/update/policy/update_policy.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
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
    explicit EveryFrames(long long period) : period_(period) {}

    UpdateDecision plan() override {
        ++age_;
        if (age_ < period_) {
            return {UpdateStep::kRefit, fmt::format("frame {} of {}", age_, period_)};
        }
        age_ = 0;
        return {UpdateStep::kRebuild, fmt::format("each {} frames", period_)};
    }

private:
    long long period_;
    long long age_ = 0;
};

struct Entry {
    UpdatePolicyInfo info;
    /// `argument` is what follows the colon; null if it is no good.
    std::unique_ptr<UpdatePolicy> (*make)(std::string_view argument, const UpdateConfig& config);
};

template <class Policy>
std::unique_ptr<UpdatePolicy> make_plain(std::string_view argument, const UpdateConfig&) {
    return argument.empty() ? std::make_unique<Policy>() : nullptr;
}

std::unique_ptr<UpdatePolicy> make_every(std::string_view argument, const UpdateConfig&) {
    constexpr long long kMost = 1000000;
    const auto period = parse_integer(argument);
    if (!period || *period < 1 || *period > kMost) return nullptr;
    return std::make_unique<EveryFrames>(*period);
}

std::unique_ptr<UpdatePolicy> make_auto(std::string_view argument, const UpdateConfig& config) {
    return argument.empty() ? std::make_unique<AutoPolicy>(config) : nullptr;
}

constexpr std::array kEntries = {
    Entry{{"refit", "one tree for all frames"}, make_plain<AlwaysRefit>},
    Entry{{"rebuild", "a tree for each frame"}, make_plain<AlwaysRebuild>},
    Entry{{"every:K", "a tree for K frames"}, make_every},
    Entry{{"auto", "restructured or rebuilt when the old tree has cost more than that"}, make_auto},
};

constexpr auto kInfos = [] {
    std::array<UpdatePolicyInfo, kEntries.size()> infos{};
    for (std::size_t i = 0; i < infos.size(); ++i) infos[i] = kEntries[i].info;
    return infos;
}();

std::string_view name_of(std::string_view text) { return text.substr(0, text.find(':')); }

}  // namespace

std::span<const UpdatePolicyInfo> update_policies() { return kInfos; }

std::unique_ptr<UpdatePolicy> make_update_policy(const std::string& text,
                                                 const UpdateConfig& config) {
    const std::string_view name = name_of(text);
    std::string forms;
    for (const Entry& entry : kEntries) {
        forms += fmt::format("{}{}", forms.empty() ? "" : ", ", entry.info.form);
        if (name_of(entry.info.form) != name || text.ends_with(':')) continue;
        const bool with_argument = name.size() < text.size();
        const std::string_view argument =
            with_argument ? std::string_view(text).substr(name.size() + 1) : std::string_view();
        if (auto policy = entry.make(argument, config)) return policy;
    }
    throw Error(ErrorKind::kBadArgument,
                fmt::format("{} is not one of {}, with K from 1", in_quotes(text), forms));
}

}  // namespace mray
