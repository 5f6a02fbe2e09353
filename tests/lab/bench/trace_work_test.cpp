// The rays of works, and their parts.
#include "lab/bench/trace_work.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "tests/lab/bench/star_works.h"

namespace mray::bench {
namespace {

class TraceWorks : public StarWorks {
protected:
    TraceWork secondary_of(WorkKind kind, std::uint32_t samples, std::size_t most_rays) const {
        return make_secondary_work(primary_, hits_, {&scene_.topology(), scene_.positions()}, kind,
                                   samples, most_rays);
    }
};

TEST_F(TraceWorks, PartsHoldEachTileOnce) {
    ViewSpec view;
    view.width = 192;
    view.height = 128;
    const TraceWork work = make_primary_work(
        make_image_params(view, bounds_of(scene_.world_positions()), scene_.space()));
    for (const std::size_t count : {0, 1, 2, 4, 6, 100}) {
        const std::vector<WorkPart> parts = work.parts(count);
        EXPECT_EQ(parts.size(), std::clamp<std::size_t>(count, 1, 6));
        std::size_t tile = 0;
        for (const WorkPart& part : parts) {
            EXPECT_EQ(part.begin, tile);
            EXPECT_LT(part.begin, part.end);
            tile = part.end;
        }
        EXPECT_EQ(tile, work.tiles.size());
    }
}

TEST_F(TraceWorks, PartsGiveTheAnswersOfTheWhole) {
    for (const WorkKind kind : {WorkKind::kShadow, WorkKind::kDiffuse, WorkKind::kAo}) {
        const TraceWork work = secondary(kind);
        const std::vector<Tracer> whole = our_tracers(bvh_, best_simd_target(), work);
        const std::vector<Tracer> parts = our_tracers(bvh_, best_simd_target(), work);
        for (std::size_t i = 0; i < whole.size(); ++i) {
            whole[i].trace(work.whole());
            for (const WorkPart& part : work.parts(4)) parts[i].trace(part);
            EXPECT_EQ(count_mismatches(work, whole[i].answers(), parts[i].answers()), 0u)
                << whole[i].name;
        }
    }
}

TEST_F(TraceWorks, DiffuseRaysLeaveEachSurfaceInDirectionsOfTheirOwnWithoutAnEnd) {
    const TraceWork diffuse = secondary(WorkKind::kDiffuse);
    const TraceWork ao = secondary_of(WorkKind::kAo, 1, 1u << 30);
    EXPECT_EQ(diffuse.active_count, static_cast<std::size_t>(std::ranges::count_if(
                                        hits_, [](const Hit& h) { return h.prim_id != kNoPrim; })));
    ASSERT_EQ(diffuse.rays.size(), ao.rays.size());
    std::set<std::tuple<float, float, float>> directions;
    for (std::size_t i = 0; i < ao.rays.size(); ++i) {
        if (diffuse.active[i] == 0) continue;
        const vec3 dir = diffuse.rays[i].dir;
        directions.insert({dir.x, dir.y, dir.z});
        EXPECT_EQ(diffuse.rays[i].org, ao.rays[i].org);
        EXPECT_EQ(diffuse.rays[i].tfar, kInfiniteT);
    }
    // Two of them may be equal by chance.
    EXPECT_GT(directions.size(), diffuse.active_count - diffuse.active_count / 100);
}

}  // namespace
}  // namespace mray::bench
