// A cross-check as a page for people.
#pragma once

#include <string>

#include "app/base/options.h"
#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// HTML that needs no other file and no network. It holds the object of --json with one more
/// member, "details": the pixels, commands and difference images of rows that differ.
std::string to_html(const Options& options, const CheckRun& run);

}  // namespace mray::app
