// The referee finds a planted error, and the shrinker removes everything unrelated to it.
#include "tests/fuzz/shrink/shrinker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>

#include "common/scene_queries.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/generate/dice.h"
#include "tests/fuzz/judge/referee.h"

namespace mray::fuzz {
namespace {

/// Answers like another one, but counts hits of cursed triangles twice, and points that are closest
/// to one wind once more.
class PlantedQueries final : public SceneQueries {
public:
    using IsCursed = std::function<bool(std::uint32_t prim_id)>;
    PlantedQueries(const Backend& inner, IsCursed is_cursed)
        : inner_(inner), is_cursed_(std::move(is_cursed)) {}

    void count(std::span<const Ray> rays, Crossing crossing,
               std::span<std::uint64_t> counts) const override {
        queries().count(rays, crossing, counts);
        for (std::size_t i = 0; i < rays.size(); ++i) {
            HitLists lists;
            queries().list(rays.subspan(i, 1), crossing, 1000, lists);
            counts[i] += static_cast<std::uint64_t>(std::ranges::count_if(
                lists.hits, [&](const Hit& hit) { return is_cursed_(hit.prim_id); }));
        }
    }
    void list(std::span<const Ray> rays, Crossing crossing, std::uint32_t most,
              HitLists& lists) const override {
        queries().list(rays, crossing, most, lists);
    }
    void intersect_after(std::span<const Ray> rays, std::span<const HitCursor> after,
                         Crossing crossing, std::span<Hit> hits) const override {
        queries().intersect_after(rays, after, crossing, hits);
    }
    void wind(std::span<const vec3> points, std::span<FloatWinding> windings,
              std::vector<UncertainCrossing>& uncertain) const override {
        queries().wind(points, windings, uncertain);
        std::vector<ClosestTriangle> nearest(points.size());
        queries().closest(points, kAnyDistance2, nearest);
        for (std::size_t i = 0; i < points.size(); ++i)
            windings[i].winding += is_cursed_(nearest[i].prim_id) ? 1 : 0;
    }
    void closest(std::span<const vec3> points, float most_d2,
                 std::span<ClosestTriangle> closest) const override {
        queries().closest(points, most_d2, closest);
    }

private:
    const SceneQueries& queries() const { return inner_.scene_queries(); }

    const Backend& inner_;
    IsCursed is_cursed_;
};

/// Traces like another backend, but loses triangles whose vertices have the same z, or only their
/// shadows; or its questions have planted errors.
class PlantedError final : public Backend {
public:
    enum class Loses { kHits, kOcclusion, kAnswers };
    explicit PlantedError(Loses loses)
        : Backend({"cpu", "planted errors"}),
          loses_(loses),
          inner_(cpu::make_scalar_backend({.threads = 1})) {}

    void set_scene(const Topology& topology, std::span<const vec3> positions,
                   const Bvh& bvh) override {
        topology_ = topology;
        inner_->set_scene(topology, positions, bvh);
        positions_.assign(positions.begin(), positions.end());
    }
    void set_frame(std::span<const vec3> positions, const Bvh& bvh) override {
        inner_->set_frame(positions, bvh);
        positions_.assign(positions.begin(), positions.end());
    }
    std::uint64_t refit(std::span<const vec3> positions, RefitExtent extent,
                        std::span<const IndexRange> changed) override {
        positions_.assign(positions.begin(), positions.end());
        return inner_->refit(positions, extent, changed);
    }
    std::span<const Node> nodes() override { return inner_->nodes(); }
    void read_tree(Bvh& bvh) override { inner_->read_tree(bvh); }
    void edit_tree(const TreeEdit& edit) override { inner_->edit_tree(edit); }
    void trace_image(const ImageParams& params, Frame& frame) override {
        inner_->trace_image(params, frame);
        for (std::size_t i = 0; i < frame.hits.size(); ++i) {
            if (!is_cursed(frame.hits[i])) continue;
            if (loses_ == Loses::kHits) frame.hits[i] = no_hit();
            if (loses_ == Loses::kOcclusion) frame.occlusion[i] += 1;
        }
    }
    void trace_rays(std::span<const Ray> rays, std::span<Hit> hits) override {
        inner_->trace_rays(rays, hits);
        if (loses_ != Loses::kHits) return;
        for (Hit& hit : hits)
            if (is_cursed(hit)) hit = no_hit();
    }
    const BackendTimes& finish() override { return inner_->finish(); }
    const SceneQueries& scene_queries() const override {
        if (loses_ == Loses::kAnswers) return queries_;
        return inner_->scene_queries();
    }

private:
    bool is_cursed(const Hit& hit) const { return is_cursed(hit.prim_id); }
    bool is_cursed(std::uint32_t prim_id) const {
        if (prim_id == kNoPrim) return false;
        const uvec3 t = topology_.triangles[prim_id];
        return positions_[t.x].z == positions_[t.y].z && positions_[t.x].z == positions_[t.z].z;
    }

    Loses loses_;
    std::unique_ptr<Backend> inner_;
    Topology topology_;
    std::vector<vec3> positions_;
    PlantedQueries queries_{*inner_, [this](std::uint32_t prim_id) { return is_cursed(prim_id); }};
};

/// A soup with one triangle of equal z before it, in three poses.
FuzzCase soup_with_a_flat_triangle() {
    FuzzCase soup;
    Dice dice(5);
    soup.poses.resize(3);
    for (std::uint32_t i = 0; i < 120; ++i) {
        for (auto& pose : soup.poses) {
            const dvec3 p = dice.point(1);
            pose.emplace_back(p.x, p.y, p.z);
        }
        if (i % 3 == 0) soup.triangles.push_back({i, i + 1, i + 2});
    }
    for (auto& pose : soup.poses) {
        pose[30] = {-0.25f, -0.5f, 1.5f};
        pose[31] = {0.75f, -0.25f, 1.5f};
        pose[32] = {0, 0.5f, 1.5f};
    }
    soup.frame = 1.5;
    soup.view.eye = Point{0.1, 0.2, 5};
    soup.view.target = Point{0, 0, 0};
    soup.view.light = Point{1, 2, 6};
    soup.view.width = 33;
    soup.view.height = 31;
    soup.view.rays = kRaysAo;
    soup.view.ao_count = 4;
    soup.rays = {{{0, 0, 5}, {0.01, 0, -1}, 0, 100}, {{5, 5, 5}, {0, 0, 1}, 0, 100}};
    return soup;
}

class Planted : public testing::TestWithParam<PlantedError::Loses> {
protected:
    Planted() : planted_(GetParam()) {
        variant_.backend = &planted_;
        variant_.tracer = "planted";
        variant_.tree = TreeKind::kRefitted;
    }
    std::vector<Finding> findings(const FuzzCase& fuzz_case) {
        Tally tally;
        return check_case(referee_, fuzz_case, std::span(&variant_, 1), tally);
    }
    FuzzCase shrunk(const FuzzCase& fuzz_case) {
        return shrink(fuzz_case, [this](const FuzzCase& c) -> std::optional<FailurePlace> {
            const auto found = findings(c);
            if (found.empty()) return std::nullopt;
            const Finding& first = found.front();
            if (!first.is_image()) return FailurePlace{0, 0, first.answer.index};
            const PixelDifference& p = first.image.first.front();
            return FailurePlace{p.x, p.y, 0};
        });
    }

    std::unique_ptr<Backend> brute_ = cpu::make_brute_backend({.threads = 1});
    PlantedError planted_;
    Variant variant_;
    Referee referee_{*brute_};
};

TEST_P(Planted, ErrorIsSeenAndMadeSmall) {
    const FuzzCase soup = soup_with_a_flat_triangle();
    ASSERT_FALSE(findings(soup).empty());
    const FuzzCase small = shrunk(soup);
    EXPECT_FALSE(findings(small).empty());
    EXPECT_EQ(small.triangles.size(), 1u);
    EXPECT_EQ(small.poses.size(), 1u);
    EXPECT_EQ(small.poses[0].size(), 3u);
    EXPECT_EQ(small.view.width * small.view.height, 1u);
    EXPECT_TRUE(small.rays.empty());
}

TEST_P(Planted, ErrorIsDescribed) {
    const std::string text = describe(findings(soup_with_a_flat_triangle()).front());
    EXPECT_NE(text.find("planted, refitted tree: "), std::string::npos) << text;
    EXPECT_NE(text.find("pixel "), std::string::npos) << text;
    EXPECT_NE(text.find("(0x"), std::string::npos) << text;
}

TEST_P(Planted, NothingIsSeenWithoutTheTriangle) {
    FuzzCase soup = soup_with_a_flat_triangle();
    soup.triangles.erase(soup.triangles.begin() + 10);
    EXPECT_TRUE(findings(soup).empty());
}

std::string loss_name(const testing::TestParamInfo<PlantedError::Loses>& loss) {
    return loss.param == PlantedError::Loses::kHits ? "LostHits" : "WrongOcclusion";
}
INSTANTIATE_TEST_SUITE_P(Errors, Planted,
                         testing::Values(PlantedError::Loses::kHits,
                                         PlantedError::Loses::kOcclusion),
                         loss_name);

TEST(Shrinker, FindsTheRayThatFails) {
    PlantedError planted(PlantedError::Loses::kHits);
    const auto brute = cpu::make_brute_backend({.threads = 1});
    Referee referee(*brute);
    Variant variant;
    variant.backend = &planted;
    FuzzCase rays = soup_with_a_flat_triangle();
    rays.view.width = rays.view.height = 0;
    const FuzzCase small = shrink(rays, [&](const FuzzCase& c) -> std::optional<FailurePlace> {
        Tally tally;
        const auto found = check_case(referee, c, std::span(&variant, 1), tally);
        if (found.empty()) return std::nullopt;
        return FailurePlace{0, 0, found.front().answer.index};
    });
    EXPECT_EQ(small.rays.size(), 1u);
    EXPECT_EQ(small.triangles.size(), 1u);
}

/// The case that fails in the same way with the planted errors in answers, made small.
FuzzCase small_case_of(Asked asked) {
    PlantedError planted(PlantedError::Loses::kAnswers);
    const auto brute = cpu::make_brute_backend({.threads = 1});
    Referee referee(*brute);
    Variant variant;
    variant.backend = &planted;
    FuzzCase questions = soup_with_a_flat_triangle();
    questions.view.width = questions.view.height = 0;
    questions.asks_questions = true;
    questions.points = {{0.1f, -0.2f, 0.3f}, {0.1f, 0, 1.625f}, {2, 2, 2}};
    return shrink(questions, [&](const FuzzCase& c) -> std::optional<FailurePlace> {
        Tally tally;
        for (const Finding& found : check_case(referee, c, std::span(&variant, 1), tally)) {
            if (found.answer.asked == asked)
                return FailurePlace{0, 0, found.answer.index, found.answer.index};
        }
        return std::nullopt;
    });
}

TEST(Shrinker, FindsTheRayWhoseHitsAreCountedWrongly) {
    const FuzzCase small = small_case_of(Asked::kHitCounts);
    EXPECT_EQ(small.rays.size(), 1u);
    EXPECT_TRUE(small.points.empty());
    EXPECT_EQ(small.triangles.size(), 1u);
}

TEST(Shrinker, FindsThePointThatIsWoundWrongly) {
    const FuzzCase small = small_case_of(Asked::kWindings);
    EXPECT_TRUE(small.rays.empty());
    EXPECT_EQ(small.points.size(), 1u);
    EXPECT_EQ(small.triangles.size(), 1u);
    EXPECT_TRUE(small.asks_questions);
}

TEST(Shrinker, LeavesWhatDoesNotFail) {
    const FuzzCase soup = soup_with_a_flat_triangle();
    const FuzzCase same = shrink(soup, [](const FuzzCase&) { return std::nullopt; });
    EXPECT_EQ(same.triangles, soup.triangles);
    EXPECT_EQ(same.view.width, soup.view.width);
}

}  // namespace
}  // namespace mray::fuzz
