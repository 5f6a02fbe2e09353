// The command that shows how a differing pixel comes about.
#pragma once

#include <string>

#include "app/base/options.h"
#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// The `morphray probe` that traces one pixel of options.scene as the row's variant did, or as its
/// reference. `build_at` is the frame that the refitted tree was built at.
std::string probe_command(const Options& options, const CheckRow& row, const PixelDifference& pixel,
                          double build_at, bool reference);

}  // namespace mray::app
