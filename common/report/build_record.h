// The tools and libraries that this program was built with.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/report/json_writer.h"

namespace mray {

/// A Debian package that was installed when this program was built.
struct BuildPackage {
    std::string_view name;
    std::string_view version;
};

/// Name and version of the compiler, such as "g++ 12.2.0".
std::string_view build_compiler();

/// The version of CMake, such as "3.25.1".
std::string_view build_cmake();

/// The packages of cmake/packages.txt that the build used, and the compiler's own, by name. Empty
/// where there is no dpkg, and for programs that are compiled for another architecture.
std::span<const BuildPackage> build_packages();

/// All of these as lines: compiler and CMake, and a line for each package after an empty line.
std::string build_record_text();

/// {"compiler", "cmake", "packages": {name: version}}; "packages" is null if there are none.
Json build_record_json();

}  // namespace mray
