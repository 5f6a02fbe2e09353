// The commands of the program, each in a file of its own.
#pragma once

#include "app/base/messages.h"
#include "app/base/options.h"
#include "common/interop/ray.h"

namespace mray::app {

// Each returns kOk, kCheckFailed, or kPartial after a message, and throws Error.
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

/// A sentence such as "triangle 46629, 9.28 away; all agree". It has the hit in the image, the
/// distance in world space, and says if the single ray or brute force have other bits.
std::string probe_sentence(const Hit& image, const Hit& alone, const Hit& brute, double distance);

}  // namespace mray::app
