// The judge of a driver's rays: a driver whose faults are planted, and the device's own where it
// traces rays.
#include "accuracy/suspect/suspect.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>

#include "accuracy/suspect/aimed_rays.h"
#include "accuracy/suspect/joined_meshes.h"
#include "accuracy/suspect/reproducer.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/scene_space.h"
#include "cpu/cpu_backend.h"

namespace mray::test {
namespace {

using namespace accuracy;

/// A driver that follows the rule, except for what `spoil` does to its closest hits and
/// `spoil_list` to its lists.
class PlantedDriver final : public DriverRays {
public:
    const std::string& description() const override { return description_; }
    void set_scene(const Topology& topology, std::span<const vec3> positions) override {
        backend_->set_scene(topology, positions, build_bvh(topology, positions));
    }
    bool update(std::span<const vec3> positions) override {
        backend_->refit(positions);
        return true;
    }
    void rebuild(std::span<const vec3> positions) override { update(positions); }
    void intersect(std::span<const Ray> rays, std::span<Hit> hits) override {
        backend_->trace_rays(rays, hits);
        for (Hit& hit : hits) spoil(hit);
    }
    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) override {
        std::vector<Hit> hits(rays.size());
        intersect(rays, hits);
        for (std::size_t i = 0; i < hits.size(); ++i)
            occluded[i] = (hits[i].prim_id != kNoPrim) != spoils_any_hit;
    }
    void list(std::span<const Ray> rays, std::uint32_t most, HitLists& lists) override {
        for (const Ray& ray : rays) {
            HitLists one;
            backend_->scene_queries().list(std::span(&ray, 1), Crossing::kOwner, most, one);
            spoil_list(one.hits);
            lists.hits.insert(lists.hits.end(), one.hits.begin(), one.hits.end());
            lists.listed.push_back(static_cast<std::uint32_t>(one.hits.size()));
            lists.total.push_back(one.hits.size());
        }
    }
    const DriverTimes& times() const override { return times_; }

    std::function<void(Hit&)> spoil = [](Hit&) {};
    std::function<void(std::vector<Hit>&)> spoil_list = [](std::vector<Hit>&) {};
    bool spoils_any_hit = false;

private:
    std::string description_ = "planted";
    std::unique_ptr<Backend> backend_ = cpu::make_scalar_backend();
    DriverTimes times_;
};

/// A scene of the charts in scene space, with both tracers at it.
struct Stage {
    explicit Stage(const std::string& name) {
        std::vector<FailureScene> scenes = suspect_scenes();
        FailureScene scene = *std::ranges::find(scenes, name, &FailureScene::name);
        topology = scene.topology;
        positions.resize(scene.positions.size());
        SceneSpace(bounds_of(scene.positions)).to_scene(scene.positions, positions);
        bvh = build_bvh(topology, positions);
        rays = aimed_rays(topology, positions, 4000, 1);
        closed = is_closed(topology, positions);
        driver.set_scene(topology, positions);
        ours->set_scene(topology, positions, bvh);
    }
    Judged judge() {
        return judge_suspect(driver, *ours, {topology, positions, bvh, closed}, rays);
    }

    Topology topology;
    std::vector<vec3> positions;
    Bvh bvh;
    std::vector<Ray> rays;
    bool closed = false;
    PlantedDriver driver;
    std::unique_ptr<Backend> ours = cpu::make_cpu_backend();
};

/// Checks that all faults are of one kind and that there are some.
void expect_only(const Judged& judged, Fault fault) {
    EXPECT_GT(judged.counts[fault], 0u) << name_of(fault);
    EXPECT_EQ(judged.counts.wrong(), judged.counts[fault]) << name_of(fault);
    ASSERT_FALSE(judged.findings.empty());
    EXPECT_EQ(judged.findings.front().fault, fault);
}

TEST(Suspect, IsRightWhereItFollowsTheRule) {
    for (const FailureScene& scene : suspect_scenes()) {
        const Judged judged = Stage(scene.name).judge();
        EXPECT_GT(judged.counts.rays, 3000u) << scene.name;
        EXPECT_EQ(judged.counts.wrong(), 0u) << scene.name;
        EXPECT_EQ(judged.counts.other_triangle, 0u) << scene.name;
        EXPECT_TRUE(judged.findings.empty()) << scene.name;
    }
}

TEST(Suspect, IsToldFromRightByEachKindOfClosestHit) {
    const auto spoiled = [](const std::function<void(Hit&)>& spoil) {
        Stage stage("sphere");
        stage.driver.spoil = [&](Hit& hit) {
            if (hit.prim_id != kNoPrim && hit.prim_id % 16 == 3) spoil(hit);
        };
        return stage.judge();
    };
    // At the outline a miss may be a matter of precision, elsewhere it is a hole.
    const Judged lost = spoiled([](Hit& hit) { hit = no_hit(); });
    EXPECT_GT(lost.counts[Fault::kHole], 9 * lost.counts[Fault::kLost]);
    EXPECT_EQ(lost.counts.wrong(), lost.counts[Fault::kHole] + lost.counts[Fault::kLost]);
    expect_only(spoiled([](Hit& hit) { hit.prim_id = 1 << 20; }), Fault::kBadAnswer);
    expect_only(spoiled([](Hit& hit) { hit.u = std::numeric_limits<float>::quiet_NaN(); }),
                Fault::kBadAnswer);
    // A triangle at the other side of the sphere, which few rays meet, and then not first.
    const Judged wrong = spoiled([](Hit& hit) { hit.prim_id = (hit.prim_id + 700) % 1400; });
    EXPECT_GT(wrong.counts[Fault::kWrongTriangle] + wrong.counts[Fault::kPassed], 0u);
    EXPECT_EQ(wrong.counts[Fault::kLost] + wrong.counts[Fault::kInvented], 0u);
}

TEST(Suspect, IsWrongIfItInventsAHit) {
    Stage stage("sphere");
    stage.driver.spoil = [](Hit& hit) {
        if (hit.prim_id == kNoPrim) hit = {1, 0.25f, 0.25f, 5};
    };
    const Judged judged = stage.judge();
    EXPECT_GT(judged.counts[Fault::kInvented], 0u);
    EXPECT_EQ(judged.counts[Fault::kLost], 0u);
}

TEST(Suspect, IsWrongIfAnyHitSaysOtherwise) {
    Stage stage("sphere");
    stage.driver.spoils_any_hit = true;
    EXPECT_EQ(stage.judge().counts[Fault::kAnyHit], stage.rays.size());
}

TEST(Suspect, IsToldFromRightByEachKindOfCrossing) {
    const auto spoiled = [](const std::function<void(std::vector<Hit>&)>& spoil) {
        Stage stage("sphere");
        EXPECT_TRUE(stage.closed);
        stage.driver.spoil_list = [&](std::vector<Hit>& hits) {
            if (!hits.empty()) spoil(hits);
        };
        return stage.judge();
    };
    expect_only(spoiled([](std::vector<Hit>& hits) { hits.push_back(hits.front()); }),
                Fault::kRepeated);
    expect_only(spoiled([](std::vector<Hit>& hits) { hits.pop_back(); }), Fault::kLostCrossing);
    const Judged invented = spoiled([](std::vector<Hit>& hits) {
        hits.push_back({1, 0, 0, (hits.front().prim_id + 700) % 1400});
    });
    EXPECT_GT(invented.counts[Fault::kInventedCrossing], invented.counts.rays / 4);
}

TEST(Suspect, IsWrongIfAnEdgeOfAClosedMeshCountsTwice) {
    Stage stage("sphere");
    // All triangles at an edge instead of one.
    const auto each = cpu::make_scalar_backend();
    each->set_scene(stage.topology, stage.positions, stage.bvh);
    std::size_t next = 0;
    stage.driver.spoil_list = [&](std::vector<Hit>& hits) {
        HitLists lists;
        each->scene_queries().list(std::span(&stage.rays[next++], 1), Crossing::kEach, kMostListed,
                                   lists);
        hits = lists.hits;
    };
    const Judged judged = stage.judge();
    EXPECT_GT(judged.counts[Fault::kDoubleCrossing], 0u);
    EXPECT_EQ(judged.counts.wrong(), judged.counts[Fault::kDoubleCrossing]);
}

TEST(Suspect, CountsHowFarTAndWeightsAreOff) {
    Stage stage("sphere");
    const Judged right = stage.judge();
    stage.driver.spoil = [](Hit& hit) {
        hit.t *= 1 + 0x1p-17f;
        hit.u = std::min(1.0f, hit.u + 0.125f);
    };
    const Judged wrong = stage.judge();
    const auto beyond = [](const HitErrors& errors) { return errors.t_counts[4]; };
    // 64 to 128 ulp: more than 16, at most 256.
    EXPECT_GT(beyond(wrong.counts.driver), wrong.counts.rays / 2);
    EXPECT_LT(beyond(right.counts.driver), wrong.counts.rays / 10);
    EXPECT_GE(wrong.counts.driver.worst_weight, 0.12);
    EXPECT_EQ(wrong.counts.ours.t_counts, right.counts.ours.t_counts);
    EXPECT_EQ(right.counts.driver.t_counts, right.counts.ours.t_counts);
}

TEST(Suspect, IsShrunkToTheTrianglesThatMatter) {
    Stage stage("sphere");
    stage.driver.spoil = [](Hit& hit) {
        if (hit.t < 0x1p19f) hit = no_hit();
    };
    const Judged judged = stage.judge();
    ASSERT_FALSE(judged.findings.empty());
    const Finding& finding = judged.findings.front();
    ASSERT_EQ(finding.fault, Fault::kHole);
    const auto found =
        shrink(stage.driver, *stage.ours, {stage.topology, stage.positions, stage.bvh, true},
               stage.rays[finding.ray], finding, [] {});
    ASSERT_TRUE(found.has_value());
    EXPECT_LE(found->topology.triangles.size(), 2u);
    EXPECT_EQ(found->prim_ids.size(), found->topology.triangles.size());
    const std::string text = text_of(*found, "sphere, ray 1", "planted");
    EXPECT_NE(text.find("// hole: no hit"), std::string::npos) << text;
    EXPECT_NE(text.find("static const float origin[3] = {"), std::string::npos) << text;
}

}  // namespace
}  // namespace mray::test
