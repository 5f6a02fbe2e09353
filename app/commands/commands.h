// The commands of the program, each in a file of its own.
#pragma once

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/terminal/messages.h"

namespace mray::app {

// Each function runs its command. Returns kOk, kCheckFailed, or kPartial after a message. Throws
// Error.
ExitCode run_render(const Options& options, const Messages& messages);
ExitCode run_view(const Options& options, const Messages& messages);
ExitCode run_crosscheck(const Options& options, const Messages& messages);
ExitCode run_diff(const Options& options, const Messages& messages);
ExitCode run_probe(const Options& options, const Messages& messages);
ExitCode run_profile(const Options& options, const Messages& messages);
ExitCode run_trace(const Options& options, const Messages& messages);
ExitCode run_query(const Options& options, const Messages& messages);
ExitCode run_chart(const Options& options, const Messages& messages);
ExitCode run_info(const Options& options, const Messages& messages);
ExitCode run_devices(const Options& options, const Messages& messages);

/// Runs the command that the options name.
ExitCode run_command(const Options& options, const Messages& messages);

}  // namespace mray::app
