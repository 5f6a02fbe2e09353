// A query whose memory does not suffice is an error, whichever allocation fails, and later ones are
// answered. This test replaces operator new, so it has a program to itself.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <new>
#include <thread>

#include "tests/embree/door.h"

namespace {

/// Those that succeed before one of the thread fails; less than 0: none fails.
thread_local long allocations_left = -1;

}  // namespace

void* operator new(std::size_t size) {
    if (allocations_left == 0) {
        allocations_left = -1;
        throw std::bad_alloc();
    }
    if (allocations_left > 0) --allocations_left;
    void* const memory = std::malloc(size > 0 ? size : 1);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace mray {
namespace {

using namespace door_test;

/// Returns how many rays of a packet hit.
int hit_count(RTCScene scene) {
    alignas(64) std::array<int, 16> valid;
    valid.fill(-1);
    RTCRayHit16 packet = {};
    for (std::size_t i = 0; i < 16; ++i) {
        packet.ray.org_x[i] = packet.ray.org_y[i] = 0.25f;
        packet.ray.org_z[i] = 1;
        packet.ray.dir_z[i] = -1;
        packet.ray.tfar[i] = kInfinity;
        packet.ray.mask[i] = kInvalid;
        packet.hit.geomID[i] = kInvalid;
    }
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
