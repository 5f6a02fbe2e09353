// The options that say how the tree follows the vertices.
#pragma once

#include <string>
#include <vector>

#include "common/backend.h"
#include "common/update_policy.h"

namespace morphray::app {

/// "refit|rebuild|...": the forms of all policies.
std::string update_forms();

/// The text, if it is that of a policy; throws Error(kUsage) with the option for any other.
std::string parse_update(const std::string& option, const std::string& text);

/// Several of them with commas between, each once.
std::vector<std::string> parse_updates(const std::string& option, const std::string& text);

/// "30%" of a frame, above 0, or "2.5ms". Throws Error(kUsage).
void parse_update_budget(const std::string& option, const std::string& text, UpdateConfig& config);

/// With the first_exponent of tracers like this one, unless decisions must be those of all others.
UpdateConfig for_tracer(UpdateConfig config, const Backend& tracer);

}  // namespace morphray::app
