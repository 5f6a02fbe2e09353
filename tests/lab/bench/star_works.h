// The rays of a small image of a closed mesh with many silhouettes.
#pragma once

#include <gtest/gtest.h>

#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "lab/bench/trace_work.h"
#include "tests/support/test_scene.h"

namespace mray::bench {

/// How many active rays hit something.
inline std::size_t count_hits(const TraceWork& work, const TraceAnswers& answers) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < work.rays.size(); ++i) {
        if (work.active[i] == 0) continue;
        count += work.any_hit() ? answers.occluded[i] : answers.hits[i].prim_id != kNoPrim;
    }
    return count;
}

class StarWorks : public testing::Test {
protected:
    StarWorks() : scene_(test::star(4, 3)), bvh_(build_bvh(scene_.topology(), scene_.positions())) {
        ViewSpec view;
        view.width = view.height = 64;
        view.ao_count = 2;
        view.light = {1.5, 2.5, 1};
        primary_ = make_primary_work(
            make_image_params(view, bounds_of(scene_.world_positions()), scene_.space()));
        hits_ = reference_hits(bvh_, primary_);
    }

    /// Any but primary and single rays.
    TraceWork secondary(WorkKind kind) const {
        return make_secondary_work(primary_, hits_, {&scene_.topology(), scene_.positions()}, kind,
                                   2);
    }

    /// By single rays.
    TraceAnswers expected(const TraceWork& work) const {
        const Tracer tracer = our_tracers(bvh_, best_simd_target(), work).back();
        tracer.trace(work.whole());
        const TraceAnswers answers = tracer.answers();
        EXPECT_GT(count_hits(work, answers), 100u);
        return answers;
    }

    test::TestScene scene_;
    Bvh bvh_;
    TraceWork primary_;
    AlignedVector<Hit> hits_;
};

}  // namespace mray::bench
