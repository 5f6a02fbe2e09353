// The tools that this program was built with.
#pragma once

#include <string>
#include <string_view>

#include "common/report/json_writer.h"

namespace mray {

/// Name and version of the compiler, such as "g++ 12.2.0".
std::string_view build_compiler();

/// Compiler and CMake as a line.
std::string build_record_text();

/// {"compiler", "cmake"}.
Json build_record_json();

}  // namespace mray
