// What both kinds of `profile` have in common, and the comparison of policies.
#pragma once

#include "app/base/options.h"
#include "app/report/json_parts.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"
#include "scenes/animation.h"

namespace mray::app {

Json profile_head(const ProfileOptions& options, const Animation& animation);

/// morphray profile --policies: compares update policies over an animation.
ExitCode profile_policies(const ProfileOptions& options, const Messages& messages);

}  // namespace mray::app
