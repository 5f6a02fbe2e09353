#include "common/report/build_record.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/report/build_packages.h"

namespace mray {

std::string_view build_compiler() {
#if defined(__clang__)
    return "clang " __clang_version__;
#elif defined(__GNUC__)
    return "g++ " __VERSION__;
#else
    return "unknown";
#endif
}

std::string_view build_cmake() { return kBuildCmake; }

std::span<const BuildPackage> build_packages() { return kBuildPackages; }

std::string build_record_text() {
    std::string text =
        fmt::format("compiled by {}, configured by CMake {}", build_compiler(), build_cmake());
    std::size_t width = 0;
    for (const BuildPackage& package : build_packages())
        width = std::max(width, package.name.size());
    if (width > 0) text += "\n\npackages that it was built with";
    for (const BuildPackage& package : build_packages())
        text += fmt::format("\n  {:<{}}  {}", package.name, width, package.version);
    return text;
}

Json build_record_json() {
    Json packages;
    for (const BuildPackage& package : build_packages()) packages[package.name] = package.version;
    return {{"compiler", build_compiler()}, {"cmake", build_cmake()}, {"packages", packages}};
}

}  // namespace mray
