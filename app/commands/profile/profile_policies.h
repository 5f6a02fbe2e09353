// morphray profile --policies: compares update policies over a clip.
#pragma once

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

ExitCode profile_policies(const Options& options, const Messages& messages);

}  // namespace mray::app
