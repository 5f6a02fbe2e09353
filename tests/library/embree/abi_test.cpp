// The libraries have the functions and the records of Embree's headers.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

/// The functions that the headers declare and do not define.
std::set<std::string> declared_functions() {
    std::set<std::string> names;
    const std::regex declaration(
        R"(\n\s*RTC_(?:SYCL_)?API(?!_EXTERN_C)[^;{#]*?\b(rtc\w+)\s*\([^;{]*\)\s*;)");
    for (const auto& entry : std::filesystem::directory_iterator(EMBREE_HEADERS)) {
        if (entry.path().extension() != ".h") continue;
        std::ifstream file(entry.path());
        const std::string text{std::istreambuf_iterator<char>(file), {}};
        for (std::sregex_iterator found(text.begin(), text.end(), declaration), end; found != end;
             ++found)
            names.insert((*found)[1]);
    }
    // Devices of SYCL are compiled by its compilers alone.
    for (const char* const name :
         {"rtcIsSYCLDeviceSupported", "rtcSYCLDeviceSelector", "rtcSetDeviceSYCLDevice"})
        names.erase(name);
    return names;
}

TEST(EmbreeAbi, ExportsWhatTheHeadersDeclareAndNothingElse) {
    std::set<std::string> expected = declared_functions();
    ASSERT_GT(expected.size(), 90u);
    expected.insert("rtcMakeStaticBVH");  // Embree exports it undeclared.
    Dl_info library;
    ASSERT_NE(dladdr(reinterpret_cast<void*>(&rtcNewDevice), &library), 0);
    const std::string command =
        "nm -D --defined-only --format=posix '" + std::string(library.dli_fname) + "'";
    FILE* const names = popen(command.c_str(), "r");
    ASSERT_NE(names, nullptr);
    std::set<std::string> exported;
    char name[256];
    char kind[8];
    while (std::fscanf(names, "%255s %7s%*[^\n]", name, kind) == 2)
        if (kind[0] == 'T') exported.insert(name);
    pclose(names);
    EXPECT_EQ(exported, expected);
}

TEST(EmbreeAbi, RecordsHaveTheSizesOfTheVersion) {
    EXPECT_EQ(sizeof(RTCRay), 48u);
    EXPECT_EQ(offsetof(RTCRayHit, hit), 48u);
#if MORPHRAY_EMBREE == 3
    EXPECT_EQ(sizeof(RTCRayHit), 80u);
    EXPECT_EQ(sizeof(RTCRayHit16), 16 * 80u);
#else
    EXPECT_EQ(sizeof(RTCRayHit), 96u);
    EXPECT_EQ(sizeof(RTCRayHit16), 16 * 84u);
#endif
}

TEST(EmbreeAbi, TheVersionIsThatOfTheHeaders) {
    const TestDevice device;
    EXPECT_EQ(rtcGetDeviceProperty(device.handle, RTC_DEVICE_PROPERTY_VERSION), RTC_VERSION);
    EXPECT_EQ(rtcGetDeviceProperty(device.handle, RTC_DEVICE_PROPERTY_VERSION_MAJOR),
              MORPHRAY_EMBREE);
    EXPECT_EQ(rtcGetDeviceProperty(device.handle, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED), 1);
    EXPECT_EQ(rtcGetDeviceProperty(device.handle, RTC_DEVICE_PROPERTY_CURVE_GEOMETRY_SUPPORTED), 0);
}

}  // namespace
}  // namespace mray
