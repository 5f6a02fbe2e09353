// New dynamic scenes update the trees of released ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include "tests/embree/door.h"

namespace mray {
namespace {

using namespace door_test;

constexpr const char* kBuilt = "morphray: built a tree of ";
constexpr const char* kUpdated = "morphray: updated an earlier scene's tree of ";

/// The grid at a pose, whose bounds are others at each.
Waves waves_at(int pose) {
    Waves waves(12, 0.3f * static_cast<float>(pose));
    for (Point& p : waves.vertices) p[2] *= 1 + 0.17f * static_cast<float>(pose);
    return waves;
}

std::vector<RTCRayHit> hits_above(RTCScene scene) {
    std::vector<RTCRayHit> hits;
    for (int i = 0; i < 400; ++i) {
        const float x = static_cast<float>(i % 20) / 19;
        const float y = static_cast<float>(i / 20) / 19;
        hits.push_back(trace(scene, make_ray({2 * x - 0.3f, y, 3}, {0.1f, -0.2f, -1})));
    }
    return hits;
}

void expect_same_hits(const std::vector<RTCRayHit>& a, const std::vector<RTCRayHit>& b) {
    ASSERT_EQ(a.size(), b.size());
    std::size_t hit_count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_TRUE(are_same(a[i], b[i])) << i;
        hit_count += a[i].hit.geomID != kInvalid;
    }
    EXPECT_GT(hit_count, a.size() / 8);
}

/// The primitives near points above each other, ascending.
std::vector<unsigned int> prims_near(RTCScene scene) {
    std::vector<unsigned int> prims;
    for (int i = 0; i < 20; ++i) {
        RTCPointQuery query = {0.5f, 0.5f, 0.02f * static_cast<float>(i), 0, 0.01f};
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene, &query, &context, note_prim, &prims);
    }
    std::sort(prims.begin(), prims.end());
    return prims;
}

/// The lines of `work` on stderr.
template <class Work>
std::string said(Work work) {
    testing::internal::CaptureStderr();
    work();
    return testing::internal::GetCapturedStderr();
}

RTCGeometry narrow_instance(const Door& door, RTCScene scene, float x) {
    RTCGeometry made = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(made, scene);
    const float columns[12] = {0.5f, 0, 0, 0, 1, 0, 0, 0, 1, x, 0, 0};
    rtcSetGeometryTransform(made, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    return made;
}

/// The scenes of a pose: a mesh, and a scene with that mesh twice and one beside them.
struct Made {
    RTCScene mesh;
    RTCScene whole;

    Made(const Door& door, int pose, RTCSceneFlags flags) {
        const Waves waves = waves_at(pose);
        mesh = door.committed({door.triangles(waves.vertices, waves.indices)}, flags);
        const float x = 0.1f * static_cast<float>(pose);
        whole = door.committed(
            {narrow_instance(door, mesh, x), narrow_instance(door, mesh, 1), door.triangle(-x)},
            flags);
    }
    ~Made() {
        rtcReleaseScene(whole);
        rtcReleaseScene(mesh);
    }
    Made(const Made&) = delete;
};

TEST(DoorSpareTrees, ServeNewScenesWithTheSameTriangles) {
    const Door door("verbose=1");
    const Door other;
    for (int pose = 0; pose < 6; ++pose) {
        const std::string messages = said([&] {
            const Made made(door, pose, RTC_SCENE_FLAG_DYNAMIC);
            const Made fresh(other, pose, RTC_SCENE_FLAG_NONE);
            expect_same_hits(hits_above(made.mesh), hits_above(fresh.mesh));
            expect_same_hits(hits_above(made.whole), hits_above(fresh.whole));
            EXPECT_EQ(prims_near(made.mesh), prims_near(fresh.mesh));
            EXPECT_FALSE(prims_near(made.mesh).empty());
        });
        const std::string how = pose == 0 ? kBuilt : kUpdated;
        EXPECT_EQ(messages, how + "288 triangles\n" + how + "577 triangles\n");
    }
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
}

TEST(DoorSpareTrees, FollowUpdatesAndAreLeftAgain) {
    const Door door("verbose=1");
    const Door other;
    const std::string messages = said([&] {
        for (int round = 0; round < 3; ++round) {
            Waves waves = waves_at(round);
            RTCGeometry mesh = door.triangles(waves.vertices, waves.indices);
            RTCScene scene = door.committed({mesh}, RTC_SCENE_FLAG_DYNAMIC);
            waves = waves_at(round);
            // Within the bounds, which are those of the first commit.
            for (std::size_t i = 20; i < 80; ++i) waves.vertices[i][2] *= 0.5f;
            std::memcpy(rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0),
                        waves.vertices.data(), waves.vertices.size() * sizeof(Point));
            rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
            rtcCommitScene(scene);
            RTCScene fresh = other.committed({other.triangles(waves.vertices, waves.indices)});
            expect_same_hits(hits_above(scene), hits_above(fresh));
            rtcReleaseScene(scene);
            rtcReleaseScene(fresh);
        }
    });
    EXPECT_EQ(messages, std::string(kBuilt) + "288 triangles\n" + kUpdated + "288 triangles\n" +
                            kUpdated + "288 triangles\n");
}

/// The lines of a commit of the scene, which is released.
std::string said_of(const Door& door, RTCGeometry mesh, RTCSceneFlags flags,
                    RTCBuildQuality quality = RTC_BUILD_QUALITY_MEDIUM) {
    return said([&] {
        RTCScene scene = door.scene({mesh}, flags);
        rtcSetSceneBuildQuality(scene, quality);
        rtcCommitScene(scene);
        rtcReleaseScene(scene);
    });
}

TEST(DoorSpareTrees, ServeTheSameTrianglesAlone) {
    const Waves waves = waves_at(1);
    const auto mesh = [&](const Door& door) {
        return door.triangles(waves.vertices, waves.indices);
    };
    const std::string built = std::string(kBuilt) + "288 triangles\n";
    const std::string updated = std::string(kUpdated) + "288 triangles\n";
    constexpr RTCSceneFlags kDynamic = RTC_SCENE_FLAG_DYNAMIC;
    const Door door("verbose=1");
    EXPECT_EQ(said_of(door, mesh(door), RTC_SCENE_FLAG_NONE), built);
    EXPECT_EQ(said_of(door, mesh(door), kDynamic), built);
    EXPECT_EQ(said_of(door, mesh(door), kDynamic), updated);
    // A scene that is not dynamic neither takes nor drops the tree.
    EXPECT_EQ(said_of(door, mesh(door), RTC_SCENE_FLAG_NONE), built);
    EXPECT_EQ(said_of(door, mesh(door), both(kDynamic, RTC_SCENE_FLAG_ROBUST)), updated);
    // Another quality, other triangles, more vertices, another policy.
    EXPECT_EQ(said_of(door, mesh(door), kDynamic, RTC_BUILD_QUALITY_HIGH), built);
    EXPECT_EQ(said_of(door, mesh(door), kDynamic), built);
    Waves turned = waves;
    std::swap(turned.indices[7][0], turned.indices[7][1]);
    EXPECT_EQ(said_of(door, door.triangles(turned.vertices, turned.indices), kDynamic), built);
    EXPECT_EQ(said_of(door, mesh(door), kDynamic), built);
    Waves more = waves;
    more.vertices.push_back({0.5f, 0.5f, 0.5f});
    EXPECT_EQ(said_of(door, door.triangles(more.vertices, more.indices), kDynamic), built);
    EXPECT_EQ(said_of(door, mesh(door), kDynamic), built);
    RTCGeometry refitted = mesh(door);
    rtcSetGeometryBuildQuality(refitted, RTC_BUILD_QUALITY_REFIT);
    EXPECT_EQ(said_of(door, refitted, kDynamic), built);
    EXPECT_EQ(said_of(door, mesh(door), kDynamic), built);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
}

TEST(DoorSpareTrees, OfTrianglesThatAreLeftOutServeNoOthers) {
    const Door door("verbose=1");
    const std::vector<Point> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::string built = std::string(kBuilt) + "1 triangles\n";
    // The tracer has no vertex of this mesh, and one of the next.
    EXPECT_EQ(said_of(door, door.triangles(corners, {{7, 8, 9}}), RTC_SCENE_FLAG_DYNAMIC), built);
    RTCGeometry mesh = door.triangles(corners, {{0, 0, 0}});
    RTCScene scene = door.scene({mesh}, RTC_SCENE_FLAG_DYNAMIC);
    EXPECT_EQ(said([&] { rtcCommitScene(scene); }), built);
    rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(mesh);
    rtcCommitScene(scene);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
    rtcReleaseScene(scene);
}

TEST(DoorSpareTrees, ReadNothingOfReleasedBuffers) {
    const Door door("verbose=1");
    for (int pose = 0; pose < 3; ++pose) {
        // Memory of the caller, which is gone before the next scene is made.
        Waves waves = waves_at(pose);
        RTCGeometry mesh = rtcNewGeometry(door.device, RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                   waves.vertices.data(), 0, sizeof(Point), waves.vertices.size());
        rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                   waves.indices.data(), 0, 12, waves.indices.size());
        const std::string messages = said_of(door, mesh, RTC_SCENE_FLAG_DYNAMIC);
        EXPECT_EQ(messages.find(pose == 0 ? kBuilt : kUpdated), 0u);
    }
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
}

TEST(DoorSpareTrees, AreTakenByThreadsAtTheSameTime) {
    const Door door;
    const Door other;
    std::vector<std::vector<RTCRayHit>> expected;
    for (int pose = 0; pose < 8; ++pose)
        expected.push_back(hits_above(Made(other, pose, RTC_SCENE_FLAG_NONE).whole));
    std::vector<std::thread> threads;
    for (int first = 0; first < 4; ++first) {
        threads.emplace_back([&, first] {
            for (int pose = first; pose < 8; ++pose) {
                const Made made(door, pose, RTC_SCENE_FLAG_DYNAMIC);
                expect_same_hits(hits_above(made.whole), expected[static_cast<std::size_t>(pose)]);
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
}

ssize_t monitored = 0;
bool add_bytes(void*, ssize_t bytes, bool) {
    monitored += bytes;
    return true;
}

TEST(DoorSpareTrees, AreNoMemoryOfScenes) {
    const Door door("verbose=1");
    rtcSetDeviceMemoryMonitorFunction(door.device, add_bytes, nullptr);
    for (int pose = 0; pose < 2; ++pose) {
        const Waves waves = waves_at(pose);
        const std::string messages =
            said_of(door, door.triangles(waves.vertices, waves.indices), RTC_SCENE_FLAG_DYNAMIC);
        EXPECT_EQ(messages.find(pose == 0 ? kBuilt : kUpdated), 0u);
        EXPECT_EQ(monitored, 0);
    }
}

bool refuse_memory(void*, ssize_t bytes, bool) { return bytes < 0; }

TEST(DoorSpareTrees, AreLostWhereTheMonitorRefuses) {
    const Door door("verbose=1");
    const auto mesh = [&] {
        const Waves waves = waves_at(1);
        return door.triangles(waves.vertices, waves.indices);
    };
    EXPECT_EQ(said_of(door, mesh(), RTC_SCENE_FLAG_DYNAMIC).find(kBuilt), 0u);
    RTCGeometry refused = mesh();
    rtcSetDeviceMemoryMonitorFunction(door.device, refuse_memory, nullptr);
    said_of(door, refused, RTC_SCENE_FLAG_DYNAMIC);
    EXPECT_EQ(door.error(), RTC_ERROR_OUT_OF_MEMORY);
    rtcSetDeviceMemoryMonitorFunction(door.device, nullptr, nullptr);
    EXPECT_EQ(said_of(door, mesh(), RTC_SCENE_FLAG_DYNAMIC).find(kBuilt), 0u);
    EXPECT_EQ(said_of(door, mesh(), RTC_SCENE_FLAG_DYNAMIC).find(kUpdated), 0u);
    EXPECT_EQ(door.error(), RTC_ERROR_NONE);
}

}  // namespace
}  // namespace mray
