// morphray profile --policies: what each update policy makes of a clip.
#pragma once

#include "app/messages.h"
#include "app/options.h"
#include "common/error.h"

namespace morphray::app {

ExitCode profile_policies(const Options& options, const Messages& messages);

}  // namespace morphray::app
