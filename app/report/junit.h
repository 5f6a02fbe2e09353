// A crosscheck as a JUnit report, which build servers read.
#pragma once

#include <string>

#include "app/report/reports.h"

namespace morphray::app {

/// One test case a variant, frame and kind of rays, and one a pair of trees.
std::string to_junit(const CheckReport& report);

}  // namespace morphray::app
