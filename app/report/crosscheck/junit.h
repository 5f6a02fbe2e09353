// A cross-check as a JUnit report for build servers.
#pragma once

#include <string>

#include "app/report/crosscheck/check_report.h"

namespace mray::app {

/// A test suite for each scene, with the environment as properties. It has a test case for each
/// variant, frame and kind of rays, for each pair of trees and for each image that --expect
/// compares. A scene that was not finished has one with an <error>. The root is the test suite, or
/// <testsuites> for several scenes.
std::string to_junit(const CheckRun& run);

}  // namespace mray::app
