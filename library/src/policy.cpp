// Update policies of the public interface, as those behind it.
#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <variant>

#include "library/src/scene_impl.h"

namespace morphray {

UpdatePolicy parse_update_policy(const std::string& text) {
    return detail::with_public_errors([&]() -> UpdatePolicy {
        const mray::PolicySpec spec = mray::parse_policy(text);
        switch (spec.kind) {
            case mray::PolicyKind::kRefit:
                return Refit{};
            case mray::PolicyKind::kRebuild:
                return Rebuild{};
            case mray::PolicyKind::kEvery:
                return Every{spec.period};
            default:
                return Auto{};
        }
    });
}

namespace detail {

mray::PolicySpec spec_of(const UpdatePolicy& policy) {
    if (std::holds_alternative<Refit>(policy)) return {mray::PolicyKind::kRefit};
    if (std::holds_alternative<Rebuild>(policy)) return {mray::PolicyKind::kRebuild};
    if (const auto* const every = std::get_if<Every>(&policy)) {
        if (every->poses >= 1 && every->poses <= mray::kMostPeriod)
            return {mray::PolicyKind::kEvery, every->poses};
        throw_bad_argument(fmt::format("Every: a tree is used for 1 to {} poses, not for {}",
                                       mray::kMostPeriod, every->poses));
    }
    const Auto& automatic = std::get<Auto>(policy);
    for (const auto& [name, budget] :
         {std::pair("budget_ms", automatic.budget_ms), std::pair("budget", automatic.budget)}) {
        if (std::isfinite(budget) && budget >= 0) continue;
        throw_bad_argument(
            fmt::format("Auto: {} is {}; give a finite number that is not negative", name, budget));
    }
    return {mray::PolicyKind::kAuto};
}

mray::UpdateConfig config_of(const UpdatePolicy& policy) {
    const auto* const automatic = std::get_if<Auto>(&policy);
    if (automatic == nullptr) return {};
    return {.deterministic = automatic->deterministic,
            .budget = automatic->budget,
            .budget_ms = automatic->budget_ms};
}

}  // namespace detail
}  // namespace morphray
