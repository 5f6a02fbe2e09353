// The commands of the program, each in a file of its own.
#pragma once

#include "app/base/options.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"

namespace mray::app {

// Each function runs its command. Returns kOk, kCheckFailed, or kPartial after a message. Throws
// Error.
ExitCode run_render(const RenderOptions& options, const Messages& messages);
ExitCode run_view(const ViewOptions& options, const Messages& messages);
ExitCode run_crosscheck(const CrosscheckOptions& options, const Messages& messages);
ExitCode run_diff(const DiffOptions& options, const Messages& messages);
ExitCode run_probe(const ProbeOptions& options, const Messages& messages);
ExitCode run_profile(const ProfileOptions& options, const Messages& messages);
ExitCode run_trace(const TraceOptions& options, const Messages& messages);
ExitCode run_query(const QueryOptions& options, const Messages& messages);
ExitCode run_chart(const ChartOptions& options, const Messages& messages);
ExitCode run_info(const InfoOptions& options, const Messages& messages);
ExitCode run_devices(const DevicesOptions& options, const Messages& messages);

}  // namespace mray::app
