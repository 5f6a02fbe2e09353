#include "library/src/policy.h"

#include <fmt/format.h>

#include <cmath>
#include <variant>

#include "library/src/scene/errors.h"

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

template <class... Cases>
struct Overloaded : Cases... {
    using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

mray::PolicySpec spec_of_every(const Every& every) {
    if (every.poses < 1 || every.poses > mray::kMostPeriod) {
        throw_bad_argument(fmt::format("Every: a tree is used for 1 to {} poses, not for {}",
                                       mray::kMostPeriod, every.poses));
    }
    return {mray::PolicyKind::kEvery, every.poses};
}

void check_budget(const char* name, double budget) {
    if (std::isfinite(budget) && budget >= 0) return;
    throw_bad_argument(
        fmt::format("Auto: {} is {}; give a finite number that is not negative", name, budget));
}

mray::PolicySpec spec_of_auto(const Auto& automatic) {
    check_budget("budget_ms", automatic.budget_ms);
    check_budget("budget", automatic.budget);
    return {mray::PolicyKind::kAuto};
}

}  // namespace

mray::PolicySpec spec_of(const UpdatePolicy& policy) {
    return std::visit(
        Overloaded{
            [](const Refit&) { return mray::PolicySpec{mray::PolicyKind::kRefit}; },
            [](const Rebuild&) { return mray::PolicySpec{mray::PolicyKind::kRebuild}; },
            [](const Every& every) { return spec_of_every(every); },
            [](const Auto& automatic) { return spec_of_auto(automatic); },
        },
        policy);
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
