#include "bench/packet_sweep.h"

#include <gtest/gtest.h>

#include <cstring>

#include "common/bvh_builder.h"
#include "common/camera_setup.h"
#include "tests/support/test_scene.h"

namespace morphray::bench {
namespace {

using namespace test;

bool same_bits(const Hit& a, const Hit& b) { return std::memcmp(&a, &b, sizeof(Hit)) == 0; }

/// Active rays that two answers differ in.
std::size_t count_differences(const TraceWork& work, const TraceAnswers& a, const TraceAnswers& b) {
    std::size_t differences = 0;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        if (work.active[i] == 0) continue;
        differences +=
            work.any_hit() ? a.occluded[i] != b.occluded[i] : !same_bits(a.hits[i], b.hits[i]);
    }
    return differences;
}

class PacketSweep : public testing::Test {
protected:
    PacketSweep() : scene_(star(4, 3)), bvh_(build_bvh(scene_.topology(), scene_.positions())) {
        ViewSpec view;
        view.width = view.height = 64;
        view.ao_count = 2;
        view.light = {1.5, 2.5, 1};
        primary_ = make_primary_work(
            make_image_params(view, bounds_of(scene_.user_positions()), scene_.space()));
        hits_ = reference_hits(bvh_, primary_);
    }

    TraceWork secondary(std::uint32_t rays) const {
        return make_secondary_work(primary_, hits_, {&scene_.topology(), scene_.positions()}, rays);
    }

    void expect_same_bits(const std::vector<OurTracer>& tracers, const TraceWork& work) const {
        TraceAnswers expected(work);
        single_rays(bvh_, cpu::find_simd_target("best")).trace(work, expected);
        EXPECT_GT(count_hits(work, expected), 100u);
        for (const OurTracer& tracer : tracers) {
            TraceAnswers answers(work);
            tracer.trace(work, answers);
            if (tracer.in_picture_order && !work.any_hit()) to_ray_order(work, answers.hits);
            EXPECT_EQ(count_differences(work, expected, answers), 0u) << tracer.name;
        }
    }

    TestScene scene_;
    Bvh bvh_;
    TraceWork primary_;
    std::vector<Hit> hits_;
};

TEST_F(PacketSweep, AnswersAlikeWithPacketsOfEveryShape) {
    const auto tracers = packets_of_each_shape(bvh_, cpu::find_simd_target("best"));
    EXPECT_EQ(tracers.size(), std::size(kPacketShapes));
    expect_same_bits(tracers, primary_);
    expect_same_bits(tracers, secondary(kRaysShadow));
}

TEST_F(PacketSweep, AnswersAlikeWithBatchesOfEverySize) {
    expect_same_bits(batches_of_each_size(bvh_, cpu::find_simd_target("best")), secondary(kRaysAo));
}

}  // namespace
}  // namespace morphray::bench
