// The commands of the program, one a file.
#pragma once

#include "app/messages.h"
#include "app/options.h"
#include "common/error.h"

namespace morphray::app {

// Each does its work and returns kOk, or what else is not an error with a message of its own
// (kCheckFailed, kPartial after its message, kInterrupted, kTerminated). Throws Error.
ExitCode run_render(const Options& options, const Messages& messages);
ExitCode run_crosscheck(const Options& options, const Messages& messages);
ExitCode run_probe(const Options& options, const Messages& messages);
ExitCode run_profile(const Options& options, const Messages& messages);
ExitCode run_trace(const Options& options, const Messages& messages);
ExitCode run_chart(const Options& options, const Messages& messages);
ExitCode run_info(const Options& options, const Messages& messages);
ExitCode run_devices(const Options& options, const Messages& messages);

}  // namespace morphray::app
