// Animations large enough that each step of a frame is divided among threads: builds, refits,
// restructuring, builds in the background, images and rays. The bytes do not depend on the number
// of threads; with ThreadSanitizer (preset tsan) these tests look for races.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/scene/camera_setup.h"
#include "common/update/tree_updater.h"
#include "cpu/cpu_backend.h"
#include "scenes/procedural/procedural.h"
#include "tests/support/animation_positions.h"
#include "tests/support/backend_results.h"

namespace mray::test {
namespace {

struct FrameHashes {
    std::string step;
    std::uint64_t tree = 0;
    ImageHashes image;
    bool operator==(const FrameHashes&) const = default;
};

/// Takes each step in turn, the background build at the same time as traces.
class EveryStep final : public UpdatePolicy {
public:
    UpdateDecision plan() override { return {UpdateStep::kRefit, "scripted"}; }
    UpdateDecision review(const RefittedTree&) override {
        using enum UpdateStep;
        static constexpr UpdateStep kSteps[] = {kRebuildInBackground, kRefit, kRefit,
                                                kRestructure,         kRefit, kRebuild};
        UpdateDecision decision = {kSteps[next_++ % std::size(kSteps)], "scripted"};
        decision.build_frames = 2;
        return decision;
    }
    bool needs_tree_cost() const override { return true; }

private:
    std::size_t next_ = 0;
};

/// The steps of an animation, and the hashes of its trees and images.
std::vector<FrameHashes> take_every_step(const char* scene, std::uint64_t triangles, int threads) {
    const std::unique_ptr<Animation> animation = make_procedural(scene, triangles);
    const SceneSpace space(animation->bounds());
    const auto positions = [&](double frame) {
        std::vector<vec3> at = positions_at(*animation, frame);
        space.to_scene(at, at);
        return at;
    };
    const ImageParams params = make_image_params(
        {.width = 96, .height = 64, .rays = kRaysAo, .ao_count = 4}, animation->bounds(), space);
    const auto tracer = cpu::make_cpu_backend({.threads = threads});
    Pose pose(positions(0));
    TreeUpdater updater(animation->topology(), pose, *tracer, std::make_unique<EveryStep>(),
                        {.threads = threads}, {.deterministic = true});
    std::vector<FrameHashes> hashes;
    for (int frame = 1; frame <= 6; ++frame) {
        pose.move_to(positions(2 * frame));
        const TreeUpdate& update = updater.update();
        hashes.push_back({name_of(update.step), 0, image_hashes(*tracer, params)});
        hashes.back().tree = tree_hash(*tracer);
        updater.frame_done(last_trace(*tracer));
    }
    return hashes;
}

TEST(ParallelUpdates, GiveTheSameBytesOnOneAndOnFourThreadsInEveryStep) {
    for (const auto& [scene, triangles] :
         {std::pair{"orbits", 20000}, {"herd", 20000}, {"cloth", 180000}}) {
        const std::vector<FrameHashes> hashes = take_every_step(scene, triangles, 4);
        EXPECT_TRUE(hashes == take_every_step(scene, triangles, 1)) << scene;
        if (std::string_view(scene) != "orbits") continue;
        std::vector<std::string> steps;
        for (const FrameHashes& frame : hashes) steps.push_back(frame.step);
        for (const char* step : {"refit", "restructure", "swap", "rebuild"})
            EXPECT_TRUE(std::ranges::count(steps, step) > 0)
                << step << testing::PrintToString(steps);
    }
}

}  // namespace
}  // namespace mray::test
