// Regret from given times, and the trees that schedules are measured from.
#include "scenes/policy_runs.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/errors.h"
#include "scenes/procedural/procedural.h"

namespace mray {
namespace {

/// A comparison of the policies "a", "b" ... that took these totals, each in two frames.
PolicyComparison comparison(double best_schedule_ms, const std::vector<double>& totals_ms) {
    PolicyComparison result;
    result.best.total = best_schedule_ms;
    double least = best_schedule_ms;
    for (const double total : totals_ms) {
        PolicyRun& run = result.runs.emplace_back();
        run.policy = std::string(1, static_cast<char>('a' + result.runs.size() - 1));
        run.frames.resize(2);
        for (PolicyFrame& frame : run.frames) frame.times.trace_ms = total / 2;
        least = std::min(least, total);
    }
    for (PolicyRun& run : result.runs) run.best_ms = least;
    return result;
}

/// Takes as many milliseconds for an image as there were refits since its tree was built, and one.
class AgesInRefits final : public Backend {
public:
    AgesInRefits() : Backend({"ages", "ages"}) {}

    void set_scene(const Topology&, std::span<const vec3>, const Bvh& bvh) override { take(bvh); }
    void set_frame(std::span<const vec3>, const Bvh& bvh) override { take(bvh); }
    std::uint64_t refit(std::span<const vec3>, RefitExtent, std::span<const IndexRange>) override {
        ++refits_;
        return 1;
    }
    std::span<const Node> nodes() override { return bvh_.nodes; }
    void read_tree(Bvh& bvh) override { bvh = bvh_; }
    void edit_tree(const TreeEdit& edit) override { edit(bvh_); }
    void trace_image(const ImageParams&, Frame&) override { times_.trace_ms = 1 + refits_; }
    void trace(const RayBatch&) override {}
    void query(const QueryBatch&) override {}
    const BackendTimes& finish() override { return times_; }

private:
    void take(const Bvh& bvh) {
        bvh_ = bvh;
        refits_ = 0;
    }

    Bvh bvh_;
    int refits_ = 0;
    BackendTimes times_;
};

TEST(PolicyRunner, MeasuresSchedulesFromTreesOfTheirOwn) {
    SceneFrames scene(make_procedural("cloth", 500));
    const std::vector<double> frames = {0, 1, 2};
    PolicyRunner runner(scene, frames, {}, {}, 2, std::make_unique<AgesInRefits>());
    const PolicyComparison result =
        runner.compare(std::vector{PolicySpec{PolicyKind::kRefit}}, [] {});
    // After each policy the tree of the first frame is built again.
    EXPECT_EQ(result.costs.first, (std::vector<double>{2, 3, 4}));
    for (std::size_t age = 1; age < result.costs.built[0].size(); ++age)
        EXPECT_EQ(result.costs.built[0][age], 1 + static_cast<double>(age));
    for (const PolicyFrame& frame : result.runs[0].frames) EXPECT_EQ(frame.trace_rebuilt_ms, 1);
    const PolicyRun& run = result.runs[0];
    ASSERT_EQ(run.totals_ms.size(), 2u);
    for (std::size_t f = 0; f < run.frames.size(); ++f) {
        const auto trace_ms = 1 + static_cast<double>(f);
        EXPECT_EQ(run.frames[f].traces_ms, (std::vector<double>{trace_ms, trace_ms}));
        EXPECT_EQ(run.frames[f].costs_ms.size(), 2u);
    }
    EXPECT_GE(run.totals_ms[0], 1 + 2 + 3);
}

TEST(Regret, IsAgainstTheBestScheduleUnlessAPolicyTookLess) {
    EXPECT_EQ(comparison(3, {4, 3, 5}).best_policy(), "");
    EXPECT_EQ(comparison(3, {4, 2, 1, 5}).best_policy(), "c");
}

}  // namespace
}  // namespace mray
