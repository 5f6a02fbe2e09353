#include "common/update/policy/policy_spec.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

// In the order of PolicyKind.
constexpr std::array kForms = {
    PolicyForm{"refit", "one tree for all frames"},
    PolicyForm{"rebuild", "a tree for each frame"},
    PolicyForm{"every:K", "a tree for K frames"},
    PolicyForm{"auto", "restructured or rebuilt when the old tree has cost more than that"},
};
constexpr std::string_view kEvery = "every:";

std::optional<PolicySpec> read_policy(const std::string& text) {
    if (text.starts_with(kEvery)) {
        const auto period = parse_integer(std::string_view(text).substr(kEvery.size()));
        if (!period || *period < 1 || *period > static_cast<long long>(kMostPeriod)) return {};
        return PolicySpec{PolicyKind::kEvery, static_cast<std::uint32_t>(*period)};
    }
    for (const PolicyKind kind : {PolicyKind::kRefit, PolicyKind::kRebuild, PolicyKind::kAuto}) {
        if (text == kForms[static_cast<std::size_t>(kind)].form) return PolicySpec{kind};
    }
    return {};
}

}  // namespace

std::span<const PolicyForm> policy_forms() { return kForms; }

std::string text_of(const PolicySpec& policy) {
    if (policy.kind == PolicyKind::kEvery) return fmt::format("{}{}", kEvery, policy.period);
    return kForms[static_cast<std::size_t>(policy.kind)].form;
}

PolicySpec parse_policy(const std::string& text) {
    if (const std::optional<PolicySpec> policy = read_policy(text)) return *policy;
    std::string forms;
    for (const PolicyForm& form : kForms)
        forms += fmt::format("{}{}", forms.empty() ? "" : ", ", form.form);
    throw Error(ErrorKind::kBadArgument,
                fmt::format("{} is not one of {}, with K from 1", quote(text), forms));
}

}  // namespace mray
