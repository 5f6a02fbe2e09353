// The parts of clips that are read frame by frame.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "clips/interpolate.h"
#include "clips/keyframes/keyframe_cache.h"
#include "clips/keyframes/measure_positions.h"
#include "clips/keyframes/streamed_clip.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

/// Keyframes of positions (keyframe, vertex, 0), which counts what is read.
class CountedSource : public KeyframeSource {
public:
    CountedSource(std::size_t count, std::atomic<int>& reads) : count_(count), reads_(reads) {}
    std::size_t count() const override { return count_; }
    double frame(std::size_t keyframe) const override { return static_cast<double>(keyframe); }
    const std::filesystem::path& file(std::size_t) const override { return file_; }
    std::vector<std::filesystem::path> files() const override { return {file_}; }
    KeyframeNotes read(std::size_t keyframe, std::span<vec3> out) const override {
        ++reads_;
        for (std::size_t i = 0; i < out.size(); ++i)
            out[i] = vec3(static_cast<float>(keyframe), static_cast<float>(i), 0);
        return {};
    }

private:
    std::size_t count_;
    std::atomic<int>& reads_;
    std::filesystem::path file_ = "none";
};

std::unique_ptr<Clip> counted_clip(std::size_t count, std::uint32_t vertices,
                                   std::atomic<int>& reads, const Watch& watch = {}) {
    FirstMesh first;
    first.topology.vertex_count = vertices;
    first.topology.triangles = {{0, 1, 2}};
    first.topology.albedo = {kDefaultAlbedo};
    return stream_keyframes({.name = "counted", .first = std::move(first)},
                            std::make_unique<CountedSource>(count, reads), {.watch = watch});
}

TEST(StreamedClip, IsWatchedWhileItsKeyframesAreRead) {
    std::atomic<int> reads = 0;
    std::atomic<bool> cancel = false;
    std::atomic<float> done = -1.0f;
    counted_clip(200, 3, reads, Watch(&cancel, &done));
    EXPECT_EQ(reads, 200);
    // The one that stores last need not be the one that read last.
    EXPECT_GT(done, 0.5f);
    cancel = true;
    EXPECT_EQ(kind_of([&] { counted_clip(200, 3, reads, Watch(&cancel)); }), ErrorKind::kCancelled);
    EXPECT_EQ(reads, 200);
}

// Four keyframes are beyond KeyframeCache::kResidentBytes.
constexpr std::uint32_t kLarge = KeyframeCache::kResidentBytes / sizeof(vec3) / 3;

TEST(KeyframeCache, KeepsAllOfASmallClip) {
    KeyframeCache cache(3, kLarge);
    EXPECT_TRUE(cache.keeps_all());
    for (std::size_t i = 0; i < 3; ++i) cache.add(i, std::make_shared<std::vector<vec3>>(i));
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(cache.find(i)->size(), i);
}

TEST(KeyframeCache, KeepsTheTwoOfALargeClipThatWereUsedLast) {
    KeyframeCache cache(4, kLarge);
    EXPECT_FALSE(cache.keeps_all());
    for (std::size_t i = 0; i < 2; ++i) cache.add(i, std::make_shared<std::vector<vec3>>(i));
    EXPECT_NE(cache.find(0), nullptr);
    cache.add(2, std::make_shared<std::vector<vec3>>(2));
    EXPECT_NE(cache.find(0), nullptr);
    EXPECT_EQ(cache.find(1), nullptr);
    EXPECT_NE(cache.find(2), nullptr);
    EXPECT_EQ(cache.find(3), nullptr);
}

TEST(StreamedClip, ReadsTheKeyframesOfASmallClipOnce) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Clip> clip = counted_clip(100, 4, reads);
    std::vector<vec3> positions(4);
    for (double frame = 0; frame <= 99; frame += 0.25) clip->positions(frame, positions);
    EXPECT_EQ(reads, 100);
    EXPECT_EQ(clip->bounds().upper[0], 99);
    EXPECT_EQ(clip->bounds().upper[1], 3);
}

TEST(StreamedClip, ReadsAKeyframeOfALargeClipOnceWhenItIsPlayed) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Clip> clip = counted_clip(4, kLarge, reads);
    EXPECT_EQ(reads, 4);
    std::vector<vec3> positions(kLarge);
    for (const double frame : {0.25, 0.5, 1.0, 1.5, 1.75}) {
        clip->positions(frame, positions);
        EXPECT_EQ(positions[3].x, static_cast<float>(frame));
    }
    EXPECT_EQ(reads, 4 + 3);
}

TEST(StreamedClip, GivesAllThreadsTheirFrames) {
    std::atomic<int> reads = 0;
    const std::unique_ptr<Clip> clip = counted_clip(50, 1000, reads);
    std::atomic<int> wrong = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            std::vector<vec3> positions(1000);
            for (int i = 0; i < 200; ++i) {
                const double frame = (i * 37 + t * 11) % 98 / 2.0;
                clip->positions(frame, positions);
                wrong += positions[999] != vec3(static_cast<float>(frame), 999, 0);
            }
        });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

TEST(MeasurePositions, FindsTheBoundsThatAPlainLoopFinds) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> number(-9, 9);
    for (std::size_t count = 0; count < 150; ++count) {
        std::vector<vec3> points(count);
        for (vec3& p : points) p = {number(random), number(random) * 1e9f, number(random) / 1e30f};
        const PositionMeasures measures = measure_positions(points);
        const WorldBounds expected = bounds_of(points);
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_EQ(measures.bounds.lower[axis], expected.lower[axis]) << count;
            EXPECT_EQ(measures.bounds.upper[axis], expected.upper[axis]) << count;
        }
        EXPECT_FALSE(measures.bad);
    }
}

TEST(MeasurePositions, FindsABadCoordinateInAnyPlace) {
    for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity(), -1.1e30f}) {
        for (const std::size_t count : {1u, 15u, 16u, 17u, 40u}) {
            for (std::size_t at = 0; at < 3 * count; ++at) {
                std::vector<vec3> points(count, vec3(1, 2, 3));
                points[at / 3][static_cast<int>(at % 3)] = bad;
                const PositionMeasures measures = measure_positions(points);
                ASSERT_TRUE(measures.bad);
                EXPECT_EQ(measures.bad->vertex, at / 3);
                const WorldBounds expected = bounds_of(points);
                EXPECT_EQ(measures.bounds.lower[0], expected.lower[0]);
                EXPECT_EQ(measures.bounds.upper[2], expected.upper[2]);
            }
        }
    }
}

}  // namespace
}  // namespace mray
