// The promises about threads of the library in place of Embree's: library/embree/*.h and
// docs/guide/embree.md. Races without a wrong answer are seen by ThreadSanitizer (cmake/tsan/run).
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <latch>
#include <optional>
#include <thread>
#include <vector>

#include "tests/library/embree/door.h"
#include "tests/support/run_together.h"

namespace mray {
namespace {

using namespace door_test;
using test::run_together;

/// The hits of rays down onto a grid of places.
std::vector<RTCRayHit> hits_from_above(RTCScene scene) {
    std::vector<RTCRayHit> hits;
    for (int y = 1; y < 12; ++y)
        for (int x = 1; x < 12; ++x)
            hits.push_back(
                trace(scene, down(static_cast<float>(x) / 12, static_cast<float>(y) / 12)));
    return hits;
}

bool are_all_same(const std::vector<RTCRayHit>& a, const std::vector<RTCRayHit>& b) {
    bool same = a.size() == b.size();
    for (std::size_t i = 0; same && i < a.size(); ++i) same = are_same(a[i], b[i]);
    return same;
}

/// Some attach to and detach from an instanced scene while others commit scenes with it.
TEST(DoorThreads, AttachToAnInstancedSceneDuringCommits) {
    const Door door;
    RTCScene child = door.committed({door.triangle()});
    RTCGeometry lower = door.triangle(-1);
    run_together(4, [&](std::size_t thread) {
        if (thread % 2 == 0) {
            for (int i = 0; i < 200; ++i) {
                const unsigned int id = rtcAttachGeometry(child, lower);
                if (i % 2 == 0) rtcDetachGeometry(child, id);
            }
            return;
        }
        for (int i = 0; i < 20; ++i) {
            RTCGeometry instance = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
            rtcSetGeometryInstancedScene(instance, child);
            RTCScene scene = door.committed({instance});
            EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
            rtcReleaseScene(scene);
        }
    });
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseGeometry(lower);
    rtcReleaseScene(child);
}

/// The first of several threads that join a commit works, and all find the scene committed.
TEST(DoorThreads, JoinEachCommitOfMovedPositions) {
    const Door door;
    const Waves waves(20);
    RTCGeometry mesh = door.triangles(waves.vertices, waves.indices);
    RTCScene scene = door.committed({mesh});
    auto* const vertices =
        static_cast<Point*>(rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0));
    for (int pose = 1; pose <= 8; ++pose) {
        const auto height = static_cast<float>(pose);
        for (std::size_t i = 0; i < waves.vertices.size(); ++i) vertices[i][2] = -height;
        rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
        rtcCommitGeometry(mesh);
        std::atomic<int> wrong = 0;
        constexpr std::size_t kThreads = 4;
        std::latch committed(kThreads);
        run_together(kThreads, [&](std::size_t) {
            rtcJoinCommitScene(scene);
            committed.arrive_and_wait();
            if (trace(scene, down(0.4f, 0.5f)).ray.tfar != 1 + height) ++wrong;
            if (door.error() != RTC_ERROR_NONE) ++wrong;
        });
        EXPECT_EQ(wrong, 0) << pose;
    }
    rtcReleaseScene(scene);
}

/// Scenes that share a mesh and a scene that they instance are independent otherwise.
TEST(DoorThreads, CommitScenesOfTheirOwnAtTheSameTime) {
    const Door door;
    const Waves waves(20);
    RTCGeometry shared = door.triangles(waves.vertices, waves.indices);
    rtcCommitGeometry(shared);
    RTCScene child = door.committed({door.triangle(-2)});
    const auto work = [&] {
        RTCScene scene = rtcNewScene(door.device);
        rtcAttachGeometry(scene, shared);
        RTCGeometry instance = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, child);
        RTCGeometry own = door.triangles(waves.vertices, waves.indices);
        for (RTCGeometry geometry : {instance, own}) {
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene, geometry);
        }
        auto* const vertices =
            static_cast<Point*>(rtcGetGeometryBufferData(own, RTC_BUFFER_TYPE_VERTEX, 0));
        std::vector<RTCRayHit> all;
        for (int pose = 0; pose < 6; ++pose) {
            for (std::size_t i = 0; i < waves.vertices.size(); ++i) vertices[i][2] += 0.05f;
            rtcUpdateGeometryBuffer(own, RTC_BUFFER_TYPE_VERTEX, 0);
            rtcCommitGeometry(own);
            rtcCommitScene(scene);
            const std::vector<RTCRayHit> hits = hits_from_above(scene);
            all.insert(all.end(), hits.begin(), hits.end());
        }
        EXPECT_EQ(door.error(), RTC_ERROR_NONE);
        rtcReleaseGeometry(instance);
        rtcReleaseGeometry(own);
        rtcReleaseScene(scene);
        return all;
    };
    const std::vector<RTCRayHit> expected = work();
    std::array<std::vector<RTCRayHit>, 4> found;
    run_together(found.size(), [&](std::size_t i) { found[i] = work(); });
    for (const std::vector<RTCRayHit>& hits : found) EXPECT_TRUE(are_all_same(hits, expected));
    rtcReleaseGeometry(shared);
    rtcReleaseScene(child);
}

/// Packets of 16 are traced in memory that each thread keeps.
TEST(DoorThreads, TracePacketsInMemoryOfTheirOwn) {
    const Door door;
    const Waves waves(20);
    RTCScene scene = door.committed({door.triangles(waves.vertices, waves.indices)});
    const auto work = [&](std::size_t seed) {
        std::vector<float> found;
        alignas(64) std::array<int, 16> valid;
        valid.fill(-1);
        for (std::size_t k = 0; k < 100; ++k) {
            RTCRayHit16 packet;
            std::memset(&packet, 0, sizeof packet);
            for (std::size_t i = 0; i < 16; ++i) {
                packet.ray.org_x[i] = static_cast<float>((seed * 31 + k * 7 + i) % 97) / 97;
                packet.ray.org_y[i] = static_cast<float>((seed * 17 + k * 3 + i) % 89) / 89;
                packet.ray.org_z[i] = 1;
                packet.ray.dir_z[i] = -1;
                packet.ray.tfar[i] = kInfinity;
                packet.ray.mask[i] = kInvalid;
                packet.hit.geomID[i] = kInvalid;
            }
            trace_packet(rtcIntersect16, valid.data(), scene, &packet);
            found.insert(found.end(), packet.ray.tfar, packet.ray.tfar + 16);
        }
        return found;
    };
    std::array<std::vector<float>, 4> expected;
    for (std::size_t i = 0; i < expected.size(); ++i) expected[i] = work(i);
    std::array<std::vector<float>, 4> found;
    run_together(found.size(), [&](std::size_t i) { found[i] = work(i); });
    EXPECT_EQ(found, expected);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

/// A program's object with static storage, whose destructor asks after the thread's own objects are
/// gone.
struct LateCaller {
    ~LateCaller() {
        // Memory that was the thread's is the program's now.
        std::vector<std::vector<char>> blocks;
        for (int i = 0; i < 200; ++i)
            for (const std::size_t size : {1, 2, 16, 64, 128, 320, 512})
                blocks.emplace_back(size, 'x');
        if (!is_answered()) std::_Exit(2);
        for (const std::vector<char>& block : blocks)
            for (const char byte : block)
                if (byte != 'x') std::_Exit(3);
    }
    /// Traces packets and rays with masks, and takes an error.
    bool is_answered() const {
        alignas(64) std::array<int, 16> valid;
        valid.fill(-1);
        RTCRayHit16 packet = packet_down();
        trace_packet(rtcIntersect16, valid.data(), scene, &packet);
        bool is_right = packet.hit.geomID[7] == 0;
        for (const unsigned int mask : {2, 1}) {
            const RTCRayHit ray = make_ray({0.25f, 0.25f, 1}, {0, 0, -1}, 0, kInfinity, mask);
            is_right &= trace(scene, ray).hit.geomID == mask - 1;
        }
        rtcReleaseScene(nullptr);
        return is_right && rtcGetDeviceError(nullptr) == RTC_ERROR_INVALID_ARGUMENT;
    }

    RTCScene scene = nullptr;
};

TEST(DoorThreads, AnswerAfterTheirOwnObjectsAreGone) {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    EXPECT_EXIT(
        {
            static const Door door("threads=1");
            static LateCaller late;
            std::vector<RTCGeometry> meshes;
            for (const unsigned int mask : {1, 2}) {
                meshes.push_back(door.triangle(-static_cast<float>(mask)));
                rtcSetGeometryMask(meshes.back(), mask);
            }
            late.scene = door.committed(meshes);
            std::exit(late.is_answered() ? 0 : 1);
        },
        testing::ExitedWithCode(0), "");
}

/// Each thread takes the errors of its own calls, and no others.
TEST(DoorThreads, TakeTheErrorsOfTheirOwnCalls) {
    const Door door;
    RTCScene committed = door.committed({door.triangle()});
    RTCScene empty = rtcNewScene(door.device);
    std::atomic<int> wrong = 0;
    run_together(4, [&](std::size_t thread) {
        // A count that they share would order them.
        int mine = 0;
        const auto expect = [&](RTCError error) {
            mine += door.error() != error;
            mine += door.error() != RTC_ERROR_NONE;
        };
        for (int i = 0; i < 200; ++i) {
            trace(committed, down(0.2f, 0.2f));
            expect(RTC_ERROR_NONE);
            if (thread % 2 == 0) {
                rtcAttachGeometry(committed, nullptr);
                expect(RTC_ERROR_INVALID_ARGUMENT);
            } else {
                trace(empty, down(0.2f, 0.2f));
                expect(RTC_ERROR_INVALID_OPERATION);
            }
        }
        wrong += mine;
    });
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(empty);
    rtcReleaseScene(committed);
}

/// Devices that are made at the same time have errors of their own.
TEST(DoorThreads, MakeDevicesAtTheSameTime) {
    constexpr std::size_t kThreads = 4;
    constexpr std::size_t kEach = 8;
    std::array<std::array<RTCDevice, kEach>, kThreads> devices;
    run_together(kThreads, [&](std::size_t thread) {
        for (RTCDevice& device : devices[thread]) device = rtcNewDevice("threads=1");
    });
    rtcAttachGeometry(nullptr, nullptr);
    EXPECT_EQ(rtcGetDeviceError(nullptr), RTC_ERROR_INVALID_ARGUMENT);
    for (const auto& some : devices) {
        for (RTCDevice device : some) {
            rtcSetDeviceProperty(device, RTC_DEVICE_PROPERTY_VERSION, 1);
            for (const auto& others : devices)
                for (RTCDevice other : others)
                    EXPECT_EQ(rtcGetDeviceError(other),
                              other == device ? RTC_ERROR_INVALID_ARGUMENT : RTC_ERROR_NONE);
        }
    }
    run_together(kThreads, [&](std::size_t thread) {
        for (RTCDevice device : devices[thread]) rtcReleaseDevice(device);
    });
}

TEST(DoorThreads, FindGeometriesWhileOthersAttach) {
    const Door door;
    RTCScene scene = door.scene({door.triangle()});
    RTCGeometry first = rtcGetGeometry(scene, 0);
    std::atomic<int> wrong = 0;
    run_together(4, [&](std::size_t thread) {
        int mine = 0;
        for (unsigned int i = 0; i < 100; ++i) {
            if (thread < 2) {
                RTCGeometry mesh = door.triangle(static_cast<float>(i));
                const unsigned int id = rtcAttachGeometry(scene, mesh);
                mine += rtcGetGeometryThreadSafe(scene, id) != mesh;
                rtcDetachGeometry(scene, id);
                rtcReleaseGeometry(mesh);
            } else {
                mine += rtcGetGeometryThreadSafe(scene, 0) != first;
                rtcGetGeometryThreadSafe(scene, i);
            }
        }
        mine += door.error() != RTC_ERROR_NONE;
        wrong += mine;
    });
    EXPECT_EQ(wrong, 0);
    rtcReleaseScene(scene);
}

/// The thread that releases the last reference destroys what the others used before.
TEST(DoorThreads, RetainAndReleaseTogether) {
    const Door door;
    std::atomic<int> wrong = 0;
    for (int round = 0; round < 50; ++round) {
        RTCScene scene = rtcNewScene(door.device);
        RTCGeometry mesh = door.triangle();
        rtcCommitGeometry(mesh);
        constexpr std::size_t kThreads = 4;
        // Each thread has a reference of its own.
        for (std::size_t i = 1; i < kThreads; ++i) rtcRetainScene(scene), rtcRetainGeometry(mesh);
        run_together(kThreads, [&](std::size_t) {
            rtcRetainScene(scene);
            rtcReleaseScene(scene);
            rtcAttachGeometry(scene, mesh);
            rtcReleaseGeometry(mesh);
            rtcReleaseScene(scene);
            wrong += door.error() != RTC_ERROR_NONE;
        });
    }
    EXPECT_EQ(wrong, 0);
}

bool count_primitives(RTCPointQueryFunctionArguments* arguments) {
    ++*static_cast<int*>(arguments->userPtr);
    return false;
}

/// The first point queries at a pose make a tree of boxes that all share.
TEST(DoorThreads, AskTheFirstPointQueriesTogether) {
    const Door door;
    // To make the tree takes longer than to start the threads, on a busy machine, too.
    constexpr unsigned int kSide = 64;
    const Waves waves(kSide);
    RTCGeometry mesh = door.triangles(waves.vertices, waves.indices);
    RTCScene scene = door.committed({mesh});
    for (int pose = 0; pose < 8; ++pose) {
        std::atomic<int> wrong = 0;
        std::atomic<bool> is_made = false;
        run_together(6, [&](std::size_t thread) {
            // Takes what a thread has of its own. Then some wait for another one's query, and
            // nothing but the tree of boxes orders them after it.
            trace(scene, down(0.5f, 0.5f));
            while (thread >= 4 && !is_made.load(std::memory_order_relaxed))
                std::this_thread::yield();
            int mine = 0;
            for (int i = 0; i < 3; ++i) {
                RTCPointQuery query = {0, 0, 0, 0, kInfinity};
                RTCPointQueryContext context;
                rtcInitPointQueryContext(&context);
                int visited = 0;
                rtcPointQuery(scene, &query, &context, count_primitives, &visited);
                mine += visited != 2 * kSide * kSide;
                is_made.store(true, std::memory_order_relaxed);
            }
            mine += door.error() != RTC_ERROR_NONE;
            wrong += mine;
        });
        EXPECT_EQ(wrong, 0) << pose;
        rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
        rtcCommitGeometry(mesh);
        rtcCommitScene(scene);
    }
    rtcReleaseScene(scene);
}

}  // namespace
}  // namespace mray
