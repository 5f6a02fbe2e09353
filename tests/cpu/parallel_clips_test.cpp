// Clips large enough that each step of a frame is divided among threads: builds, refits,
// restructuring, builds in the background, images and rays. The bytes do not depend on the number
// of threads; with ThreadSanitizer (preset tsan) these tests look for races.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "clips/procedural/procedural.h"
#include "common/scene/camera_setup.h"
#include "cpu/cpu_backend.h"
#include "tests/support/backend_hashes.h"
#include "tests/support/followed_clip.h"
#include "tests/support/last_trace.h"

namespace mray::test {
namespace {

struct FrameHashes {
    std::string step;
    std::uint64_t tree = 0;
    ImageHashes image;
    bool operator==(const FrameHashes&) const = default;
};

ImageParams params_of(const SceneFrames& frames) {
    ViewSpec view;
    view.width = 96;
    view.height = 64;
    view.rays = kRaysAo;
    view.ao_count = 4;
    return frames.image_params(view);
}

/// Follows a clip under a policy: the tree and the image of each frame.
std::vector<FrameHashes> follow(const std::string& scene, std::uint64_t triangles,
                                const std::string& policy, int threads) {
    SceneFrames frames(make_procedural(scene, triangles));
    FollowedClip clip(frames, 0, parse_policy(policy), {.deterministic = true, .budget = 0.02},
                      threads, cpu::make_cpu_backend({.threads = threads}));
    std::vector<FrameHashes> hashes;
    for (const double frame : {0.0, 1.0, 9.0, 10.0, 2.5}) {
        clip.advance(frame);
        Frame image;
        clip.trace(params_of(frames), image);
        hashes.push_back({name_of(clip.last_update().step),
                          bvh_hash(clip.tree()),
                          {hits_hash(image), image_hash(image)}});
    }
    return hashes;
}

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
    bool may_restructure() const override { return true; }

private:
    std::size_t next_ = 0;
};

/// The steps of a clip whose parts fly apart, and the hashes of its trees and images.
std::vector<FrameHashes> take_every_step(int threads) {
    SceneFrames frames(make_procedural("explode", 20000));
    const Topology& topology = frames.clip().topology();
    const auto tracer = cpu::make_cpu_backend({.threads = threads});
    TreeUpdater updater(topology, frames.positions(0), *tracer, nullptr,
                        std::make_unique<EveryStep>(), {.threads = threads},
                        {.deterministic = true});
    std::vector<FrameHashes> hashes;
    for (int frame = 1; frame <= 6; ++frame) {
        const TreeUpdate& update = updater.update(frames.positions(2 * frame));
        hashes.push_back({name_of(update.step), 0, image_hashes(*tracer, params_of(frames))});
        hashes.back().tree = bvh_hash(updater.tree());
        updater.frame_done(last_trace(*tracer));
    }
    return hashes;
}

struct ParallelClip {
    const char* scene;
    std::uint64_t triangles;
    const char* policy;
};

class ParallelClips : public testing::TestWithParam<ParallelClip> {};

INSTANTIATE_TEST_SUITE_P(Cpu, ParallelClips,
                         testing::Values(ParallelClip{"herd", 20000, "refit"},
                                         ParallelClip{"herd", 20000, "rebuild"},
                                         ParallelClip{"shuffle", 20000, "auto"},
                                         ParallelClip{"cloth", 180000, "every:2"}),
                         [](const auto& parameter) {
                             const ParallelClip& clip = parameter.param;
                             std::string name = std::string(clip.scene) + "_" + clip.policy;
                             std::ranges::replace(name, ':', '_');
                             return name;
                         });

TEST_P(ParallelClips, GiveTheSameBytesOnOneAndOnFourThreads) {
    const auto [scene, triangles, policy] = GetParam();
    EXPECT_TRUE(follow(scene, triangles, policy, 4) == follow(scene, triangles, policy, 1));
}

TEST(ParallelUpdates, GiveTheSameBytesOnOneAndOnFourThreadsInEveryStep) {
    const std::vector<FrameHashes> hashes = take_every_step(4);
    EXPECT_TRUE(hashes == take_every_step(1));
    std::vector<std::string> steps;
    for (const FrameHashes& frame : hashes) steps.push_back(frame.step);
    for (const char* step : {"refit", "restructure", "swap", "rebuild"})
        EXPECT_TRUE(std::ranges::count(steps, step) > 0) << step << testing::PrintToString(steps);
}

}  // namespace
}  // namespace mray::test
