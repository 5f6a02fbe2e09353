// The name of an update policy, as users write it.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace mray {

enum class PolicyKind { kRefit, kRebuild, kEvery, kAuto };

/// The most frames that one tree of kEvery may be used for.
inline constexpr std::uint32_t kMostPeriod = 1000000;

struct PolicySpec {
    PolicyKind kind = PolicyKind::kRefit;
    /// The frames that a tree is used for, from 1 to kMostPeriod; 0 for kinds other than kEvery.
    std::uint32_t period = 0;
    bool operator==(const PolicySpec&) const = default;
};

/// "refit", "rebuild", "every:8" or "auto".
std::string text_of(const PolicySpec& policy);

/// Reads what text_of() writes. Throws Error(kBadArgument), which lists the forms, for other texts.
PolicySpec parse_policy(const std::string& text);

struct PolicyForm {
    /// "refit", or with a count "every:K".
    const char* form;
    const char* description;
};
/// All kinds, in the order of the help text.
std::span<const PolicyForm> policy_forms();

}  // namespace mray
