#include "common/report/build_record.h"

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

std::string build_record_text() {
    return "compiled by " + std::string(build_compiler()) +
           ", configured by CMake " MORPHRAY_CMAKE_VERSION;
}

Json build_record_json() {
    return {{"compiler", build_compiler()}, {"cmake", MORPHRAY_CMAKE_VERSION}};
}

}  // namespace mray
