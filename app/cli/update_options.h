// The options that say how the tree follows the vertices.
#pragma once

#include <string>
#include <vector>

#include "common/update/policy/update_policy.h"

namespace morphray::app {

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms();

/// The text, if it is that of a policy; throws Error(kBadArgument) with the option for any other.
std::string parse_update(const std::string& option, const std::string& text);

/// Several of them with commas between, each once.
std::vector<std::string> parse_updates(const std::string& option, const std::string& text);

/// "30%" of a frame, above 0, or "2.5ms". Throws Error(kBadArgument).
void parse_update_budget(const std::string& option, const std::string& text, UpdateConfig& config);

}  // namespace morphray::app
