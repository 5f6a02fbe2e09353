// The parts of animations that are read frame by frame.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "scenes/mesh/mesh_file.h"
#include "scenes/sequence/streamed_animation.h"

namespace mray {
namespace {

/// Keyframes of positions (keyframe, vertex, 0), which counts what is read.
class CountedSource : public KeyframeSource {
public:
    CountedSource(std::size_t count, std::atomic<int>& reads) : count_(count), reads_(reads) {}
    std::size_t count() const override { return count_; }
    double frame(std::size_t keyframe) const override { return static_cast<double>(keyframe); }
    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const override {
        ++reads_;
        for (std::size_t i = 0; i < out.size(); ++i)
            out[i] = vec3(static_cast<float>(keyframe), static_cast<float>(i), 0);
        return std::nullopt;
    }

private:
    std::size_t count_;
    std::atomic<int>& reads_;
};

std::unique_ptr<Animation> counted_animation(std::size_t count, std::uint32_t vertices,
                                             std::atomic<int>& reads) {
    FirstMesh first;
    first.topology.vertex_count = vertices;
    first.topology.triangles = {{0, 1, 2}};
    first.topology.albedo = {kClay};
    return stream_keyframes("counted", std::move(first),
                            std::make_unique<CountedSource>(count, reads), {});
}

// Four keyframes are beyond the 128 MiB that stay in memory.
constexpr std::uint32_t kLarge = (std::uint32_t{128} << 20) / sizeof(vec3) / 3;

TEST(StreamedAnimation, ReadsTheKeyframesOfASmallAnimationOnce) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Animation> animation = counted_animation(100, 4, reads);
    std::vector<vec3> positions(4);
    for (double frame = 0; frame <= 99; frame += 0.25) animation->positions(frame, positions);
    EXPECT_EQ(reads, 100);
    EXPECT_EQ(animation->bounds().upper[0], 0);
    // No triangle uses the fourth vertex.
    EXPECT_EQ(animation->bounds().upper[1], 2);
}

TEST(StreamedAnimation, ReadsAKeyframeOfALargeAnimationOnceWhenItIsPlayed) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Animation> animation = counted_animation(4, kLarge, reads);
    EXPECT_EQ(reads, 1);
    std::vector<vec3> positions(kLarge);
    for (const double frame : {0.25, 0.5, 1.0, 1.5, 1.75}) {
        animation->positions(frame, positions);
        EXPECT_EQ(positions[3].x, static_cast<float>(frame));
    }
    EXPECT_EQ(reads, 3);
}

TEST(StreamedAnimation, GivesAllThreadsTheirFrames) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Animation> animation = counted_animation(50, 1000, reads);
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            std::vector<vec3> positions(1000);
            for (int i = 0; i < 200; ++i) {
                const double frame = (i * 37 + t * 11) % 98 / 2.0;
                animation->positions(frame, positions);
                wrong += positions[999] != vec3(static_cast<float>(frame), 999, 0);
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace mray
