// Hits of triangles and quads, rays that hit nothing, masks, filters, packets and streams, and
// point queries.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "morphray/device.hpp"
#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

TEST(EmbreeHits, HaveTheNormalAndWeightsOfEmbree) {
    const TestDevice device;
    RTCScene scene = device.committed({device.triangle()});
    const RTCRayHit hit = trace(scene, down(0.25f, 0.5f, 2));
    EXPECT_EQ(hit.ray.tfar, 2);
    EXPECT_EQ(hit.hit.u, 0.25f);
    EXPECT_EQ(hit.hit.v, 0.5f);
    EXPECT_EQ(hit.hit.Ng_z, 1);
    EXPECT_EQ(hit.hit.geomID, 0u);
    EXPECT_EQ(hit.hit.primID, 0u);
    EXPECT_EQ(hit.hit.instID[0], kInvalid);
    // From below the normal is the same.
    EXPECT_EQ(trace(scene, make_ray({0.25f, 0.5f, -2}, {0, 0, 1})).hit.Ng_z, 1);
    EXPECT_TRUE(is_occluded(scene, down(0.25f, 0.5f)));
    EXPECT_FALSE(is_occluded(scene, down(0.75f, 0.5f)));
}

TEST(EmbreeHits, MissesAndBadRaysChangeNoBitAndAreNoErrors) {
    const TestDevice device;
    RTCScene scene = device.committed({device.triangle()});
    for (const RTCRayHit& bad :
         {make_ray({kNan, 0, 1}, {0, 0, -1}), make_ray({0.2f, 0.2f, 1}, {kNan, 0, -1}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, kNan),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 0, kNan),
          make_ray({0.2f, 0.2f, kInfinity}, {0, 0, -1}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -kInfinity}), make_ray({0.2f, 0.2f, 0}, {0, 0, 0}),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 2, 0.5f),
          make_ray({0.2f, 0.2f, 1}, {0, 0, -1}, 0, -1), down(2, 2)}) {
        EXPECT_TRUE(are_same(trace(scene, bad), bad));
        RTCRay ray = bad.ray;
        occluded1(scene, ray);
        EXPECT_EQ(std::memcmp(&ray, &bad.ray, sizeof ray), 0);
    }
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
}

TEST(EmbreeHits, StridesAndSharedBuffersAreRead) {
    const TestDevice device;
    struct Vertex {
        float normal[3];
        Point position;
        float rest;
    };
    const std::vector<Vertex> vertices = {
        {{}, {0, 0, 0}, 0}, {{}, {1, 0, 0}, 0}, {{}, {0, 1, 0}, 0}};
    const std::vector<std::array<unsigned int, 5>> indices = {{9, 9, 0, 1, 2}};
    RTCGeometry mesh = rtcNewGeometry(device.handle, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.data(),
                               12, sizeof(Vertex), vertices.size());
    rtcSetSharedGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(), 8,
                               20, 1);
    RTCScene scene = device.committed({mesh});
    EXPECT_EQ(trace(scene, down(0.25f, 0.5f)).hit.v, 0.5f);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
}

TEST(EmbreeHits, BoundsAreThoseOfTriangles) {
    const TestDevice device;
    // Two vertices belong to no triangle. They stretch no scene so far that the triangle is a
    // point.
    RTCScene scene = device.committed({device.triangles(
        {{-1, 0, 0}, {1, 0, 2}, {9, 9, 9}, {0, 3, 0}, {-3e38f, 2e38f, 1e38f}}, {{0, 1, 3}})});
    const RTCRayHit hit = trace(scene, down(0, 1, 3));
    EXPECT_NEAR(hit.hit.v, 1 / 3.0f, 1e-6f);
    RTCBounds bounds;
    rtcGetSceneBounds(scene, &bounds);
    EXPECT_EQ(bounds.lower_x, -1);
    EXPECT_EQ(bounds.upper_x, 1);
    EXPECT_EQ(bounds.upper_y, 3);
    EXPECT_EQ(bounds.upper_z, 2);
    RTCLinearBounds linear = {};
    rtcGetSceneLinearBounds(scene, &linear);
    for (const RTCBounds& each : {linear.bounds0, linear.bounds1}) {
        EXPECT_EQ(each.lower_x, -1);
        EXPECT_EQ(each.upper_z, 2);
    }
    rtcGetSceneLinearBounds(scene, nullptr);
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_ARGUMENT);
    RTCScene empty = device.committed({});
    rtcGetSceneBounds(empty, &bounds);
    EXPECT_EQ(bounds.lower_x, kInfinity);
    EXPECT_EQ(bounds.upper_x, -kInfinity);
    EXPECT_EQ(trace(empty, down(0, 0)).hit.geomID, kInvalid);
    EXPECT_FALSE(is_occluded(empty, down(0, 0)));
}

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
}

TEST_F(EmbreeFilters, HitsAtOnePlaceAreAllSeenInOrder) {
    RTCScene scene =
        device_.committed({device_.triangle(), device_.triangle(), device_.triangle(-1)});
    Query query;
    query.filter = filter;
    const RTCRayHit hit = trace(scene, down(0.25f, 0.25f), query);
    EXPECT_EQ(hit.hit.geomID, kInvalid);
    EXPECT_EQ(seen_.geom_ids, (std::vector<unsigned int>{0, 1, 2}));
}

TEST_F(EmbreeFilters, QuadsAreSeenOnceThroughTheirDiagonal) {
    for (const bool of_geometry : {false, true}) {
        RTCGeometry quad =
            device_.quads({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{{0, 1, 2, 3}}});
        Query query;
        if (of_geometry) rtcSetGeometryIntersectFilterFunction(quad, filter);
        if (!of_geometry) query.filter = filter;
        seen_ = {};
        trace(device_.committed({quad}), down(0.5f, 0.5f), query);
        EXPECT_EQ(seen_.t.size(), 1u);
    }
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
}

/// Camera rays row by row, which are traced in packets, and rays of all directions.
std::vector<RTCRayHit> mixed_rays() {
    std::vector<RTCRayHit> rays;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 48; ++x)
            rays.push_back(make_ray({0.5f, 0.5f, 2}, {0.012f * static_cast<float>(x - 24),
                                                      0.012f * static_cast<float>(y - 20), -1}));
    for (int i = 0; i < 500; ++i) {
        const float a = 0.7f * static_cast<float>(i);
        rays.push_back(make_ray({std::sin(a), std::cos(3 * a), 0.3f},
                                {std::cos(a), std::sin(2 * a), -0.2f * std::sin(a)}));
    }
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i].ray.id = static_cast<unsigned int>(i);
    return rays;
}

class EmbreeStreams : public testing::Test {
protected:
    EmbreeStreams() {
        const Waves waves(40);
        scene_ = device_.committed(
            {device_.triangles(waves.vertices, waves.indices), device_.triangle()});
        for (RTCRayHit& ray : expected_) intersect1(scene_, ray);
        for (const RTCRayHit& ray : mixed_rays()) {
            RTCRay occluded = ray.ray;
            occluded1(scene_, occluded);
            occluded_.push_back(occluded);
        }
    }
    ~EmbreeStreams() override { EXPECT_EQ(device_.error(), RTC_ERROR_NONE); }

    void expect_hits(const std::vector<RTCRayHit>& rays) const {
        ASSERT_EQ(rays.size(), expected_.size());
        for (std::size_t i = 0; i < rays.size(); ++i)
            ASSERT_TRUE(are_same(rays[i], expected_[i])) << i;
    }
    void expect_occlusion(const std::vector<RTCRay>& rays) const {
        for (std::size_t i = 0; i < rays.size(); ++i)
            ASSERT_EQ(std::memcmp(&rays[i], &occluded_[i], sizeof(RTCRay)), 0) << i;
    }

    template <class Packet, class RayPacket, std::size_t n, class Intersect, class Occluded>
    void check_packets(Intersect intersect, Occluded occluded) const {
        const std::vector<RTCRayHit> rays = mixed_rays();
        for (std::size_t first = 0; first + n <= rays.size(); first += n) {
            Packet packet;
            std::memset(&packet, 0x5A, sizeof packet);
            alignas(64) int valid[n];
            for (std::size_t i = 0; i < n; ++i) {
                // Some lanes are off.
                valid[i] = (first + i) % 7 == 0 ? 0 : -1;
                store_lane(&rays[first + i], &packet, n, i);
            }
            RayPacket shadow;
            std::memcpy(&shadow, &packet, sizeof shadow);
            trace_packet(intersect, valid, scene_, &packet);
            trace_packet(occluded, valid, scene_, &shadow);
            for (std::size_t i = 0; i < n; ++i) {
                RTCRayHit hit = rays[first + i];
                RTCRay dark = hit.ray;
                load_lane(&packet, &hit, n, i);
                load_lane(&shadow, &dark, n, i, kRayMembers);
                const bool is_on = valid[i] == -1;
                ASSERT_TRUE(are_same(hit, is_on ? expected_[first + i] : rays[first + i]));
                const RTCRay& expected = is_on ? occluded_[first + i] : rays[first + i].ray;
                ASSERT_EQ(std::memcmp(&dark, &expected, sizeof dark), 0);
            }
        }
    }

    TestDevice device_;
    RTCScene scene_;
    std::vector<RTCRayHit> expected_ = mixed_rays();
    std::vector<RTCRay> occluded_;
};

TEST_F(EmbreeStreams, PacketsEqualSingleRays) {
    check_packets<RTCRayHit4, RTCRay4, 4>(rtcIntersect4, rtcOccluded4);
    check_packets<RTCRayHit8, RTCRay8, 8>(rtcIntersect8, rtcOccluded8);
    check_packets<RTCRayHit16, RTCRay16, 16>(rtcIntersect16, rtcOccluded16);
}

#if MORPHRAY_EMBREE == 3

std::vector<RTCRay> rays_of(const std::vector<RTCRayHit>& hits) {
    std::vector<RTCRay> rays;
    for (const RTCRayHit& hit : hits) rays.push_back(hit.ray);
    return rays;
}

TEST_F(EmbreeStreams, StreamsOfRaysEqualSingleRays) {
    Query query;
    std::vector<RTCRayHit> rays = mixed_rays();
    const auto count = static_cast<unsigned int>(rays.size());
    std::vector<RTCRay> shadows = rays_of(rays);
    rtcIntersect1M(scene_, &query.context, rays.data(), count, sizeof(RTCRayHit));
    rtcOccluded1M(scene_, &query.context, shadows.data(), count, sizeof(RTCRay));
    expect_hits(rays);
    expect_occlusion(shadows);

    rays = mixed_rays();
    shadows = rays_of(rays);
    std::vector<RTCRayHit*> pointers;
    std::vector<RTCRay*> shadow_pointers;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        pointers.push_back(&rays[i]);
        shadow_pointers.push_back(&shadows[i]);
    }
    rtcIntersect1Mp(scene_, &query.context, pointers.data(), count);
    rtcOccluded1Mp(scene_, &query.context, shadow_pointers.data(), count);
    expect_hits(rays);
    expect_occlusion(shadows);
}

TEST_F(EmbreeStreams, LongStreamsAreTracedToTheEnd) {
    // More than are traced at a time.
    const std::vector<RTCRayHit> once = mixed_rays();
    std::vector<RTCRayHit> rays;
    while (rays.size() < 140'000) rays.insert(rays.end(), once.begin(), once.end());
    Query query;
    rtcIntersect1M(scene_, &query.context, rays.data(), static_cast<unsigned int>(rays.size()),
                   sizeof(RTCRayHit));
    for (std::size_t i = 0; i < rays.size(); ++i)
        ASSERT_TRUE(are_same(rays[i], expected_[i % once.size()])) << i;
}

#endif

bool lower_radius(RTCPointQueryFunctionArguments* arguments) {
    ++*static_cast<int*>(arguments->userPtr);
    if (arguments->query->radius <= 2) return false;
    arguments->query->radius = 2;
    return true;
}
bool count_only(RTCPointQueryFunctionArguments* arguments) {
    ++*static_cast<int*>(arguments->userPtr);
    return false;
}

TEST(EmbreePointQueries, VisitPrimitivesWithinTheRadius) {
    const TestDevice device;
    const Waves waves(16);
    RTCScene scene = device.committed(
        {device.triangles(waves.vertices, waves.indices),
         device.quads({{9, 0, 0}, {10, 0, 0}, {10, 1, 0}, {9, 1, 0}}, {{{0, 1, 2, 3}}})});
    const auto count = [&](Point at, float radius, RTCPointQueryFunction function) {
        RTCPointQuery query = {at[0], at[1], at[2], 0, radius};
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        int visited = 0;
        rtcPointQuery(scene, &query, &context, function, &visited);
        return visited;
    };
    EXPECT_EQ(count({0, 0, 0}, kInfinity, count_only), 2 * 16 * 16 + 1);
    EXPECT_EQ(count({9.5f, 0.5f, 3}, 3, count_only), 1);
    EXPECT_EQ(count({9.5f, 0.5f, 3}, 2.9f, count_only), 0);
    // The nearest primitives come first, and once the radius is small no others.
    EXPECT_LE(count({9.5f, 0.5f, 1}, kInfinity, lower_radius), 4);
    EXPECT_EQ(count({kInfinity, 0, 0}, 1, count_only), 0);
    EXPECT_EQ(device.error(), RTC_ERROR_NONE);
}

bool changes_once(RTCPointQueryFunctionArguments* arguments) {
    auto& context = *static_cast<RTCPointQueryContext*>(arguments->userPtr);
    EXPECT_EQ(arguments->context, &context);
    EXPECT_EQ(context.instStackSize, 1u);
    EXPECT_EQ(context.instID[0], 1u);
    // (11, 20, 30) is at (0.5, 0, 0) of the child, whose axes have changed places.
    EXPECT_EQ(context.world2inst[0][1], 0.5f);
    EXPECT_EQ(context.world2inst[0][4], 0.5f);
    EXPECT_EQ(context.world2inst[0][10], 0.5f);
    EXPECT_EQ(context.world2inst[0][12], -10.0f);
    EXPECT_EQ(context.world2inst[0][13], -5.0f);
    EXPECT_EQ(context.inst2world[0][12], 10.0f);
    EXPECT_EQ(arguments->similarityScale, 0.5f);
    const bool is_first = arguments->query->radius > 100;
    arguments->query->radius = 100;
    return is_first;
}

TEST(EmbreePointQueries, KnowTheInstance) {
    const TestDevice device;
    RTCScene child = device.committed({device.triangle(), device.triangle(-1)});
    RTCScene scene = instance_of(device, child, RTC_FORMAT_FLOAT3X4_ROW_MAJOR,
                                 {0, 2, 0, 10, 2, 0, 0, 20, 0, 0, 2, 30});
    rtcDetachGeometry(scene, 0);
    rtcCommitScene(scene);
    RTCPointQuery query = {11, 20, 30, 0, 200};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    EXPECT_TRUE(rtcPointQuery(scene, &query, &context, changes_once, &context));
    EXPECT_EQ(context.instStackSize, 0u);
    EXPECT_EQ(context.instID[0], kInvalid);
    EXPECT_FALSE(rtcPointQuery(scene, &query, &context, changes_once, &context));
    // A caller's own stack of instances is refused.
    context.instStackSize = 1;
    EXPECT_FALSE(rtcPointQuery(scene, &query, &context, changes_once, &context));
    EXPECT_EQ(device.error(), RTC_ERROR_INVALID_OPERATION);
}

}  // namespace
}  // namespace mray
