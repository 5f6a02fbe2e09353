// The promises about threads of the library in place of Embree's: library/embree/*.h and
// docs/guide/embree.md. Races without a wrong answer are seen by ThreadSanitizer (cmake/tsan/run).
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <latch>
#include <vector>

#include "tests/library/embree/embree_api.h"
#include "tests/support/run_together.h"

namespace mray {
namespace {

using namespace embree_test;
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

/// The first of several threads that join a commit works, and all find the scene committed.
TEST(EmbreeThreads, JoinEachCommitOfMovedPositions) {
    const TestDevice device;
    const Waves waves(20);
    RTCGeometry mesh = device.triangles(waves.vertices, waves.indices);
    RTCScene scene = device.committed({mesh});
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
            if (device.error() != RTC_ERROR_NONE) ++wrong;
        });
        EXPECT_EQ(wrong, 0) << pose;
    }
}

/// Scenes that share a mesh and a scene that they instance are independent otherwise.
TEST(EmbreeThreads, CommitScenesOfTheirOwnAtTheSameTime) {
    const TestDevice device;
    const Waves waves(20);
    RTCGeometry shared = device.triangles(waves.vertices, waves.indices);
    rtcCommitGeometry(shared);
    RTCScene child = device.committed({device.triangle(-2)});
    const auto work = [&] {
        RTCScene scene = rtcNewScene(device.handle);
        rtcAttachGeometry(scene, shared);
        RTCGeometry instance = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, child);
        RTCGeometry own = device.triangles(waves.vertices, waves.indices);
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
        EXPECT_EQ(device.error(), RTC_ERROR_NONE);
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
}

/// The first point queries at a pose make a tree of boxes that all share.
TEST(EmbreeThreads, AskTheFirstPointQueriesTogether) {
    const TestDevice device;
    // To make the tree takes longer than to start the threads, on a busy machine, too.
    constexpr unsigned int kSide = 64;
    const Waves waves(kSide);
    RTCGeometry mesh = device.triangles(waves.vertices, waves.indices);
    RTCScene scene = device.committed({mesh});
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
                const auto count = [](RTCPointQueryFunctionArguments* arguments) {
                    ++*static_cast<int*>(arguments->userPtr);
                    return false;
                };
                rtcPointQuery(scene, &query, &context, count, &visited);
                mine += visited != 2 * kSide * kSide;
                is_made.store(true, std::memory_order_relaxed);
            }
            mine += device.error() != RTC_ERROR_NONE;
            wrong += mine;
        });
        EXPECT_EQ(wrong, 0) << pose;
        rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
        rtcCommitGeometry(mesh);
        rtcCommitScene(scene);
    }
}

}  // namespace
}  // namespace mray
