// morphray profile --policies: compares update policies over a clip.
#pragma once

#include "app/cli/exit_code.h"
#include "app/cli/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

ExitCode profile_policies(const Options& options, const Messages& messages);

}  // namespace mray::app
