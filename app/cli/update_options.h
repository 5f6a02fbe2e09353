// Values of the options of tree updates.
#pragma once

#include <string>
#include <vector>

#include "common/update/policy/update_policy.h"

namespace mray::app {

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms();

/// Returns `text` if it is a policy. Throws Error(kBadArgument) with the option for any other text.
std::string parse_update(const std::string& option, const std::string& text);

/// Policies separated by commas, each at most once.
std::vector<std::string> parse_updates(const std::string& option, const std::string& text);

/// Reads "30%" of a frame or "2.5ms", above 0, into `config`. Throws Error(kBadArgument).
void parse_update_budget(const std::string& option, const std::string& text, UpdateConfig& config);

}  // namespace mray::app
