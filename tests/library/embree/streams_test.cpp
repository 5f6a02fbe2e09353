// Packets and streams answer as single rays do, bit for bit.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/library/embree/embree_api.h"

namespace mray {
namespace {

using namespace embree_test;

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
    ~EmbreeStreams() override {
        EXPECT_EQ(device_.error(), RTC_ERROR_NONE);
        rtcReleaseScene(scene_);
    }

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

}  // namespace
}  // namespace mray
