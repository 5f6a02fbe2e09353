// Outputs that would overwrite each other, or what is read.
#pragma once

#include "app/base/options.h"

namespace mray::app {

/// Throws Error(kBadArgument) for two outputs in one file, for an output in a file that is read,
/// and for one with a name of the images and parts in the folders of the command. Devices, pipes
/// and stdout are no files in this sense, and --json may replace the --baseline. Other files of a
/// scene than the one that is named are not known here.
void check_output_conflicts(const Options& options);

}  // namespace mray::app
