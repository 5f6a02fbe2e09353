// A cross-check as a page for people.
#pragma once

#include <string>

#include "app/base/options.h"
#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// HTML that needs no other file and no network: the verdict, for each scene a matrix of its
/// variants and images, the images that differ with both images and the commands that trace a
/// pixel, the environment, and the object of --json. A page of 500 comparisons has at most 5 MB.
std::string to_html(const Options& options, const CheckRun& run);

}  // namespace mray::app
