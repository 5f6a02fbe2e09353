// A query whose memory does not suffice is an error, whichever allocation fails, and later ones are
// answered. This test replaces operator new, so it has a program to itself.
#include <gtest/gtest.h>

#include <array>
#include <thread>

#include "tests/embree/door.h"
#include "tests/support/failing_new.h"

namespace mray {
namespace {

using namespace door_test;
using test::allocations_left;

/// Returns how many rays of a packet hit.
int hit_count(RTCScene scene) {
    alignas(64) std::array<int, 16> valid;
    valid.fill(-1);
    RTCRayHit16 packet = packet_down();
    trace_packet(rtcIntersect16, valid.data(), scene, &packet);
    int count = 0;
    for (const unsigned int id : packet.hit.geomID) count += id == 0;
    return count;
}

TEST(DoorMemory, PacketsAreAnsweredAfterOneThatFails) {
    const Door door;
    RTCScene scene = door.committed({door.triangle()});
    long failed = 0;
    bool has_failed = true;
    while (has_failed) {
        // A new thread has no memory yet.
        std::thread([&] {
            allocations_left = failed;
            const int first = hit_count(scene);
            allocations_left = -1;
            has_failed = first != 16;
            EXPECT_EQ(door.error() == RTC_ERROR_OUT_OF_MEMORY, has_failed);
            EXPECT_EQ(hit_count(scene), 16);
            EXPECT_EQ(door.error(), RTC_ERROR_NONE);
        }).join();
        failed += has_failed;
    }
    EXPECT_GE(failed, 4);
    rtcReleaseScene(scene);
}

}  // namespace
}  // namespace mray
