// Update policies of the public interface, as those behind it.
#include <fmt/format.h>

#include <cmath>
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
namespace {

void check_budget(const char* name, double budget) {
    if (std::isfinite(budget) && budget >= 0) return;
    throw_bad_argument(
        fmt::format("Auto: {} is {}; give a finite number that is not negative", name, budget));
}

}  // namespace

mray::PolicySpec spec_of(const UpdatePolicy& policy) {
    if (std::holds_alternative<Refit>(policy)) return {mray::PolicyKind::kRefit};
    if (std::holds_alternative<Rebuild>(policy)) return {mray::PolicyKind::kRebuild};
    if (const auto* const every = std::get_if<Every>(&policy)) {
        if (every->poses >= 1 && every->poses <= mray::kMostPeriod)
            return {mray::PolicyKind::kEvery, every->poses};
        throw_bad_argument(fmt::format("Every: a tree is used for 1 to {} poses, not for {}",
                                       mray::kMostPeriod, every->poses));
    }
    check_budget("budget_ms", std::get<Auto>(policy).budget_ms);
    check_budget("budget", std::get<Auto>(policy).budget);
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
