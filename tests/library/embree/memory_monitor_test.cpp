// The function that a program watches memory with.
#include <gtest/gtest.h>

#include <cstdint>

#include "tests/library/embree/door.h"

namespace mray {
namespace {

using namespace door_test;

ssize_t taken = 0;
bool monitor(void* user, ssize_t bytes, bool) {
    if (bytes > 0 && user != nullptr) return false;
    taken += bytes;
    return true;
}

TEST(DoorMemoryMonitor, SeesAllAndMayRefuse) {
    // The first commit of a scene, and the second one.
    for (const bool is_first : {true, false}) {
        taken = 0;
        const Door door;
        rtcSetDeviceMemoryMonitorFunction(door.device, monitor, nullptr);
        RTCScene scene = door.scene({door.triangle()});
        if (!is_first) {
            rtcCommitScene(scene);
            RTCGeometry more = door.triangle(-1);
            rtcAttachGeometry(scene, more);
            rtcReleaseGeometry(more);
        }
        EXPECT_GT(taken, 0);
        int refuses = 0;
        rtcSetDeviceMemoryMonitorFunction(door.device, monitor, &refuses);
        rtcCommitScene(scene);
        EXPECT_EQ(door.error(), RTC_ERROR_OUT_OF_MEMORY);
        rtcReleaseScene(scene);
        EXPECT_EQ(taken, 0);
    }
}

// With AddressSanitizer such an allocation ends the program.
#ifndef MORPHRAY_SANITIZED
TEST(DoorMemoryMonitor, SeesWhatABufferThatDoesNotFitGivesBack) {
    taken = 0;
    const Door door;
    rtcSetDeviceMemoryMonitorFunction(door.device, monitor, nullptr);
    EXPECT_EQ(rtcNewBuffer(door.device, SIZE_MAX / 4), nullptr);
    EXPECT_EQ(door.error(), RTC_ERROR_OUT_OF_MEMORY);
    EXPECT_EQ(taken, 0);
    RTCGeometry mesh = door.triangle();
    const ssize_t before = taken;
    EXPECT_EQ(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                      SIZE_MAX / 64),
              nullptr);
    EXPECT_EQ(door.error(), RTC_ERROR_OUT_OF_MEMORY);
    EXPECT_EQ(taken, before);
    rtcReleaseGeometry(mesh);
    EXPECT_EQ(taken, 0);
}
#endif

}  // namespace
}  // namespace mray
