// Masks and filters.
#include <gtest/gtest.h>

#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

/// The hits that filters see, and which of them pass.
struct Seen {
    std::vector<float> t;
    std::vector<unsigned int> geom_ids;
    float least_accepted = kInfinity;
};
Seen* seen = nullptr;

void filter(const RTCFilterFunctionNArguments* arguments) {
    ASSERT_EQ(arguments->N, 1u);
    ASSERT_EQ(arguments->valid[0], -1);
    const float t = RTCRayN_tfar(arguments->ray, 1, 0);
    seen->t.push_back(t);
    seen->geom_ids.push_back(RTCHitN_geomID(arguments->hit, 1, 0));
    if (t < seen->least_accepted) arguments->valid[0] = 0;
}

class EmbreeFilters : public testing::Test {
protected:
    EmbreeFilters() { seen = &seen_; }
    Seen seen_;
    TestDevice device_;
};

TEST_F(EmbreeFilters, RejectedHitsAreFollowedByTheNext) {
    RTCGeometry upper = device_.triangle(0);
    rtcSetGeometryIntersectFilterFunction(upper, filter);
    rtcSetGeometryOccludedFilterFunction(upper, filter);
    RTCScene scene = device_.committed({upper, device_.triangle(-1)});
    const RTCRayHit hit = trace(scene, down(0.25f, 0.25f));
    EXPECT_EQ(hit.hit.geomID, 1u);
    EXPECT_EQ(hit.ray.tfar, 2);
    EXPECT_EQ(seen_.t, std::vector<float>{1});
    EXPECT_TRUE(is_occluded(scene, down(0.25f, 0.25f)));
    RTCRayHit near = down(0.25f, 0.25f);
    near.ray.tfar = 1.5f;
    EXPECT_FALSE(is_occluded(scene, near));
    EXPECT_EQ(trace(scene, near).ray.tfar, 1.5f);
    seen_.least_accepted = 0;
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f)).hit.geomID, 0u);
    rtcReleaseScene(scene);
}

TEST_F(EmbreeFilters, HitsAtOnePlaceAreAllSeenInOrder) {
    RTCScene scene =
        device_.committed({device_.triangle(), device_.triangle(), device_.triangle(-1)});
    Query query;
    query.filter = filter;
    const RTCRayHit hit = trace(scene, down(0.25f, 0.25f), query);
    EXPECT_EQ(hit.hit.geomID, kInvalid);
    EXPECT_EQ(seen_.geom_ids, (std::vector<unsigned int>{0, 1, 2}));
    rtcReleaseScene(scene);
}

TEST_F(EmbreeFilters, SeeAClosedMeshAnEvenNumberOfTimesThroughItsEdges) {
    // A cube; rays go through edges, corners and diagonals of faces.
    std::vector<Point> corners;
    for (int i = 0; i < 8; ++i)
        corners.push_back({static_cast<float>(i & 1), static_cast<float>(i >> 1 & 1),
                           static_cast<float>(i >> 2)});
    RTCScene scene = device_.committed({device_.triangles(corners, {{0, 2, 1},
                                                                    {1, 2, 3},
                                                                    {4, 5, 6},
                                                                    {5, 7, 6},
                                                                    {0, 1, 4},
                                                                    {1, 5, 4},
                                                                    {2, 6, 3},
                                                                    {3, 6, 7},
                                                                    {0, 4, 2},
                                                                    {2, 4, 6},
                                                                    {1, 3, 5},
                                                                    {3, 7, 5}})});
    Query query;
    query.filter = filter;
    for (const Point& through :
         {Point{0, 0, 0}, {1, 1, 1}, {0.5f, 0.5f, 0}, {0.5f, 0, 0}, {0, 0.5f, 0.5f}, {1, 0, 0}}) {
        const Point inside = {0.375f, 0.25f, 0.75f};
        seen_ = {};
        trace(scene,
              make_ray(inside,
                       {through[0] - inside[0], through[1] - inside[1], through[2] - inside[2]}),
              query);
        EXPECT_EQ(seen_.t.size(), 1u) << through[0] << ' ' << through[1] << ' ' << through[2];
    }
    rtcReleaseScene(scene);
}

TEST_F(EmbreeFilters, QuadsAreSeenOnceThroughTheirDiagonal) {
    RTCScene scene = device_.committed(
        {device_.quads({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{{0, 1, 2, 3}}})});
    Query query;
    query.filter = filter;
    trace(scene, down(0.5f, 0.5f), query);
    EXPECT_EQ(seen_.t.size(), 1u);
    rtcReleaseScene(scene);
    RTCGeometry quad =
        device_.quads({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{{0, 1, 2, 3}}});
    rtcSetGeometryIntersectFilterFunction(quad, filter);
    scene = device_.committed({quad});
    seen_ = {};
    trace(scene, down(0.5f, 0.5f));
    EXPECT_EQ(seen_.t.size(), 1u);
    rtcReleaseScene(scene);
}

/// Rays of one packet whose masks see both, one or none of two triangles.
template <class Packet, class Function>
Packet traced_with_masks(RTCScene scene, Function function) {
    Packet packet;
    std::memset(&packet, 0, sizeof packet);
    RTCRayHit ray = down(0.25f, 0.25f);
    for (unsigned int lane = 0; lane < 8; ++lane) {
        ray.ray.mask = lane;
        store_lane(&ray, &packet, 8, lane, sizeof(Packet) / 32);
    }
    alignas(32) const int valid[8] = {-1, -1, -1, -1, -1, -1, -1, -1};
    trace_packet(function, valid, scene, &packet);
    return packet;
}

TEST_F(EmbreeFilters, RaysOfAPacketHaveMasksOfTheirOwn) {
    RTCGeometry upper = device_.triangle(0);
    rtcSetGeometryMask(upper, 2);
    RTCGeometry lower = device_.triangle(-1);
    rtcSetGeometryMask(lower, 4);
    RTCScene scene = device_.committed({upper, lower});
    const auto hits = traced_with_masks<RTCRayHit8>(scene, rtcIntersect8);
    const auto shadows = traced_with_masks<RTCRay8>(scene, rtcOccluded8);
    for (unsigned int mask = 0; mask < 8; ++mask) {
        const unsigned int seen_id = (mask & 2) != 0 ? 0 : (mask & 4) != 0 ? 1 : kInvalid;
        EXPECT_EQ(hits.hit.geomID[mask], seen_id) << mask;
        EXPECT_EQ(shadows.tfar[mask] == -kInfinity, seen_id != kInvalid) << mask;
    }
    rtcReleaseScene(scene);
}

void count_and_reject(const RTCFilterFunctionNArguments* arguments) {
    ++*static_cast<int*>(arguments->geometryUserPtr);
    arguments->valid[0] = 0;
}

TEST_F(EmbreeFilters, TheSecondOneSeesNoHitThatTheFirstOneRejects) {
    RTCGeometry mesh = device_.triangle();
    int count = 0;
    rtcSetGeometryUserData(mesh, &count);
    rtcSetGeometryIntersectFilterFunction(mesh, count_and_reject);
    RTCScene scene = device_.committed({mesh});
    Query query;
    query.filter = filter;
    EXPECT_EQ(trace(scene, down(0.25f, 0.25f), query).hit.geomID, kInvalid);
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(seen_.t.empty());
    rtcReleaseScene(scene);
}

}  // namespace
}  // namespace mray
