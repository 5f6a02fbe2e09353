// The head of the reports of both kinds of profile.
#pragma once

#include "app/base/options.h"
#include "app/report/report_head.h"
#include "scenes/clip.h"

namespace mray::app {

/// The head of a profile's report. Throws Error(kLimit) if the memory does not suffice for the
/// clip.
ReportHead profile_head(const Options& options, const Clip& clip);

}  // namespace mray::app
