// What both kinds of profile begin with.
#pragma once

#include "app/cli/options.h"
#include "app/report/reports.h"
#include "common/scene/clip.h"

namespace morphray::app {

/// The head of a profile's report, of a clip that fits: throws Error(kLimit) where the memory would
/// not do for it.
ReportHead profile_head(const Options& options, const Clip& clip);

}  // namespace morphray::app
