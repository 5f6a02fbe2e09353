#include "lab/bench/works/packet_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/lab/bench/star_works.h"
#include "tests/support/same_bits.h"

namespace mray::bench {
namespace {

/// Active rays that two answers differ in.
std::size_t count_differences(const TraceWork& work, const TraceAnswers& a, const TraceAnswers& b) {
    std::size_t differences = 0;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        if (work.active[i] == 0) continue;
        differences += work.any_hit() ? a.occluded[i] != b.occluded[i]
                                      : !test::same_bits(a.hits[i], b.hits[i]);
    }
    return differences;
}

class PacketSweep : public StarWorks {
protected:
    void expect_same_bits(const std::vector<OurTracer>& tracers, const TraceWork& work) const {
        const TraceAnswers single = expected(work);
        for (const OurTracer& tracer : tracers) {
            if (std::ranges::count(tracer.works, work.kind) == 0) continue;
            TraceAnswers answers(work);
            tracer.trace(work, answers);
            if (tracer.in_image_order && !work.any_hit()) to_ray_order(work, answers.hits);
            EXPECT_EQ(count_differences(work, single, answers), 0u) << tracer.name;
        }
    }
};

TEST_F(PacketSweep, GivesTheSameAnswersWithPacketsOfEveryShape) {
    const auto tracers = packets_of_each_shape(bvh_, find_simd_target("best"));
    EXPECT_EQ(tracers.size(), std::size(kPacketShapes));
    expect_same_bits(tracers, primary_);
    expect_same_bits(tracers, secondary(WorkKind::kShadow));
}

TEST_F(PacketSweep, GivesTheSameAnswersWithBatchesOfEverySize) {
    const auto tracers = batches_of_each_size(bvh_, find_simd_target("best"));
    EXPECT_EQ(tracers.size(), std::size(kBatchSizes));
    expect_same_bits(tracers, secondary(WorkKind::kAo));
}

}  // namespace
}  // namespace mray::bench
