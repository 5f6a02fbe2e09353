// A crosscheck as a JUnit report for build servers.
#pragma once

#include <string>

#include "app/report/reports.h"

namespace mray::app {

/// A test case for each variant, frame and kind of rays, and for each pair of trees.
std::string to_junit(const CheckReport& report);

}  // namespace mray::app
