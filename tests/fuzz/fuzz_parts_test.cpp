// Cases read back as they were, a planted error is found, and what is unrelated to it is lost.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "tests/fuzz/case/case_text.h"
#include "tests/fuzz/generate/dice.h"
#include "tests/fuzz/generate/generator.h"
#include "tests/fuzz/judge/referee.h"
#include "tests/fuzz/shrink/shrinker.h"
#include "tests/support/same_bits.h"

namespace mray::fuzz {
namespace {

TEST(CaseText, ReadsBackBitForBit) {
    using Limits = std::numeric_limits<float>;
    std::vector<FuzzCase> cases(1);
    FuzzCase& special = cases.front();
    special.triangles = {{0, 1, 2}};
    special.poses = {{{Limits::quiet_NaN(), -Limits::infinity(), -0.0f},
                      {std::bit_cast<float>(0xFFC12345u), Limits::denorm_min(), Limits::max()},
                      {-Limits::denorm_min(), 0.1f, 1e-40f}}};
    special.view.eye = Point{-0.0, 5e-324, 0.1};
    special.rays = {{{1, 2, 3}, {0, -0.0, 1e-300}, 0, std::numeric_limits<double>::infinity()}};
    for (std::uint64_t seed = 0; seed < 200; ++seed)
        cases.insert(cases.end(), {make_case(seed), make_questions(seed)});
    for (const FuzzCase& made : cases) {
        const FuzzCase read = read_case(to_text(made, "a remark\nof two lines"), "made");
        ASSERT_EQ(to_text(read), to_text(made));
        for (std::size_t pose = 0; pose < made.poses.size(); ++pose)
            ASSERT_TRUE(test::same_bytes(read.poses[pose], made.poses[pose]));
        ASSERT_TRUE(test::same_bytes(read.rays, made.rays));
        ASSERT_TRUE(test::same_bytes(read.points, made.points));
        ASSERT_EQ(read.asks_questions, made.asks_questions);
    }
}

TEST(CaseText, NamesTheLineOfWhatItCannotRead) {
    for (const char* text :
         {"size 4 4\nsize 4", "cause x\nv 1 2 3", "# x\nfov 1x", "t 0 0 0\nw 1"}) {
        try {
            read_case(text, "broken.txt");
            FAIL() << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kBadInput);
            EXPECT_TRUE(std::string(error.what()).starts_with("broken.txt:2: ")) << error.what();
        }
    }
}

TEST(Generator, PutsATenthOfTheEyesNearAPlane) {
    int near = 0;
    int images = 0;
    for (std::uint64_t seed = 0; seed < 500; ++seed) {
        const FuzzCase made = make_case(seed);
        const FuzzScene scene(made);
        try {
            const Camera camera =
                make_image_params(made.view, scene.bounds(), scene.space()).camera;
            ++images;
            near += distance_to_planes(camera.org, scene.topology(), scene.positions()) <= 0x1p-20;
        } catch (const Error&) {
            // Refused.
        }
    }
    EXPECT_GT(images, 450);
    EXPECT_GT(near, images / 10);
}

/// Traces like another backend, but triangles whose vertices have the same z shrink to a point.
class PlantedError final : public Backend {
public:
    PlantedError()
        : Backend({"cpu", "a planted error"}), inner_(cpu::make_scalar_backend({.threads = 1})) {}

    void set_scene(const Topology& topology, std::span<const vec3> positions,
                   const Bvh& bvh) override {
        std::vector<vec3> wrong(positions.begin(), positions.end());
        for (const uvec3& t : topology.triangles) {
            if (wrong[t.x].z == wrong[t.y].z && wrong[t.x].z == wrong[t.z].z)
                wrong[t.y] = wrong[t.z] = wrong[t.x];
        }
        inner_->set_scene(topology, positions, bvh);
        inner_->refit(wrong);
    }
    void set_frame(std::span<const vec3>, const Bvh&) override { FAIL(); }
    std::uint64_t refit(std::span<const vec3>, RefitExtent, std::span<const IndexRange>) override {
        ADD_FAILURE();
        return 0;
    }
    std::span<const Node> nodes() override { return inner_->nodes(); }
    void read_tree(Bvh& bvh) override { inner_->read_tree(bvh); }
    void edit_tree(const TreeEdit& edit) override { inner_->edit_tree(edit); }
    void trace_image(const ImageParams& params, Frame& frame) override {
        inner_->trace_image(params, frame);
    }
    void trace(const RayBatch& batch) override { inner_->trace(batch); }
    void query(const QueryBatch& batch) override { inner_->query(batch); }
    const BackendTimes& finish() override { return inner_->finish(); }

private:
    std::unique_ptr<Backend> inner_;
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
    soup.asks_questions = true;
    soup.points = {{0.1f, -0.2f, 0.3f}, {0.1f, 0, 1.625f}, {2, 2, 2}};
    return soup;
}

class Planted : public testing::TestWithParam<Asked> {
protected:
    Planted() { variant_.backend = &planted_; }

    bool fails(const FuzzCase& fuzz_case) {
        Tally tally;
        for (const Finding& found :
             check_case(referee_, fuzz_case, std::span(&variant_, 1), tally)) {
            const bool is_the_one = found.answer.asked == GetParam();
            if (is_the_one && !describe(found).empty()) return true;
        }
        return false;
    }

    std::unique_ptr<Backend> brute_ = cpu::make_brute_backend({.threads = 1});
    PlantedError planted_;
    Variant variant_;
    Referee referee_{*brute_};
};

TEST_P(Planted, ErrorIsSeenAndMadeSmall) {
    FuzzCase soup = soup_with_a_flat_triangle();
    ASSERT_TRUE(fails(soup));
    const FuzzCase small = shrink(soup, [this](const FuzzCase& c) { return fails(c); });
    EXPECT_TRUE(fails(small));
    EXPECT_EQ(small.triangles.size(), 1u);
    EXPECT_EQ(small.poses.size(), 1u);
    EXPECT_EQ(small.poses[0].size(), 3u);
    const bool is_image = GetParam() == Asked::kImage;
    EXPECT_EQ(small.rays.size(), is_image || is_about_points(GetParam()) ? 0u : 1u);
    EXPECT_EQ(small.points.size(), is_about_points(GetParam()) ? 1u : 0u);
    EXPECT_EQ(small.has_image(), is_image);
    EXPECT_LE(small.view.width * small.view.height, 16u);
    soup.triangles.erase(soup.triangles.begin() + 10);
    EXPECT_FALSE(fails(soup));
}
INSTANTIATE_TEST_SUITE_P(Errors, Planted,
                         testing::Values(Asked::kImage, Asked::kClosestHits, Asked::kHitCounts,
                                         Asked::kAllHits, Asked::kClosestPoints));

}  // namespace
}  // namespace mray::fuzz
