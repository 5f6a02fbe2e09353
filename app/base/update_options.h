// Values of the options of tree updates.
#pragma once

#include <string>
#include <vector>

#include "common/update/policy/update_policy.h"

namespace mray::app {

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms();

/// As parse_policy(), with errors that name the option and suggest a policy.
PolicySpec parse_update(const std::string& option, const std::string& text);

/// Policies separated by commas, each at most once.
std::vector<PolicySpec> parse_updates(const std::string& option, const std::string& text);

/// Reads "30%" of a frame or "2.5ms", above 0, into `config`. Throws Error(kBadArgument).
void parse_update_budget(const std::string& option, const std::string& text, UpdateConfig& config);

}  // namespace mray::app
