// The commands of the program, one a file.
#pragma once

#include "app/cli/exit_code.h"
#include "app/cli/options.h"
#include "app/terminal/messages.h"

namespace morphray::app {

// Each function does the work of its command and returns kOk, kCheckFailed, or kPartial after its
// own message. Throws Error.
ExitCode run_render(const Options& options, const Messages& messages);
ExitCode run_crosscheck(const Options& options, const Messages& messages);
ExitCode run_probe(const Options& options, const Messages& messages);
ExitCode run_profile(const Options& options, const Messages& messages);
ExitCode run_trace(const Options& options, const Messages& messages);
ExitCode run_chart(const Options& options, const Messages& messages);
ExitCode run_info(const Options& options, const Messages& messages);
ExitCode run_devices(const Options& options, const Messages& messages);

}  // namespace morphray::app
