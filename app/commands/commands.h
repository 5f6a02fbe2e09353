// The commands of the program, each in a file of its own.
#pragma once

#include "app/base/messages.h"
#include "app/base/options.h"
#include "common/interop/ray.h"

namespace mray::app {

// Returns kOk, kCheckFailed, or kPartial after a message. Throws Error.
ExitCode run_command(const RenderOptions& options, const Messages& messages);
ExitCode run_command(const ViewOptions& options, const Messages& messages);
ExitCode run_command(const CrosscheckOptions& options, const Messages& messages);
ExitCode run_command(const DiffOptions& options, const Messages& messages);
ExitCode run_command(const ProbeOptions& options, const Messages& messages);
ExitCode run_command(const ProfileOptions& options, const Messages& messages);
ExitCode run_command(const TraceOptions& options, const Messages& messages);
ExitCode run_command(const QueryOptions& options, const Messages& messages);
ExitCode run_command(const ChartOptions& options, const Messages& messages);
ExitCode run_command(const InfoOptions& options, const Messages& messages);
ExitCode run_command(const DevicesOptions& options, const Messages& messages);

/// A sentence such as "triangle 46629, 9.28 away; all agree". It has the hit in the image, the
/// distance in world space, and says if the single ray or brute force have other bits.
std::string probe_sentence(const Hit& image, const Hit& alone, const Hit& brute, double distance);

}  // namespace mray::app
