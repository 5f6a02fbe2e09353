// A crosscheck as a JUnit report, which build servers read.
#pragma once

#include <string>

#include "app/report/reports.h"

namespace morphray::app {

/// One test case a variant, frame and kind of rays, and one a pair of trees.
std::string to_junit(const CheckReport& report);

/// Text for an attribute or element of XML 1.0; what XML cannot hold becomes '?'.
std::string xml_text(const std::string& text);

}  // namespace morphray::app
