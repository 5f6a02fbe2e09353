// Interpolating in scene space gives the bits of interpolating in world space.
#include "common/scene/scene_keyframes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/listed_clip.h"
#include "tests/support/test_scene.h"

namespace mray {
namespace {

using test::ListedClip;
using test::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The pose by way of world space, without the code under test.
std::vector<vec3> expected_pose(const Clip& clip, const SceneSpace& space,
                                const KeyframeBlend& blend) {
    const KeyframePositions first = clip.keyframe(blend.before);
    const KeyframePositions second = clip.keyframe(blend.after);
    const std::vector<vec3>& before = *first;
    const std::vector<vec3>& after = *second;
    std::vector<vec3> pose(before.begin(), before.end());
    for (std::size_t i = 0; i < pose.size() && blend.f != 0; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const float difference = after[i][axis] - before[i][axis];
            const float part = difference * blend.f;
            pose[i][axis] = before[i][axis] + part;
        }
    }
    space.to_scene(pose, pose);
    return pose;
}

std::vector<vec3> by_keyframes(const SceneKeyframes& keyframes, const Clip& clip,
                               const KeyframeBlend& blend) {
    std::vector<vec3> pose(clip.topology().vertex_count);
    keyframes.positions(blend, pose);
    return pose;
}

std::size_t differences(const std::vector<vec3>& a, const std::vector<vec3>& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (std::memcmp(&a[i], &b[i], sizeof(vec3)) != 0) ++count;
    }
    return count;
}

/// In the interval, often an end of it, often next to 0.
float coordinate(Random& random, double lower, double upper) {
    double x = random.real(lower, upper);
    switch (random.below(8)) {
        case 0:
            x = lower;
            break;
        case 1:
            x = upper;
            break;
        case 2:
        case 3:
            x = std::ldexp(x, -static_cast<int>(random.below(160)));
            break;
        default:
            break;
    }
    // Where 0 is not between them, that is not either.
    const auto rounded = static_cast<float>(std::min(std::max(x, lower), upper));
    if (random.below(32) == 0 && lower <= 0 && upper >= 0) return -0.0f;
    return std::min(std::max(rounded, static_cast<float>(lower)), static_cast<float>(upper));
}

float part(Random& random) {
    switch (random.below(6)) {
        case 0:
            return std::nextafter(1.0f, 0.0f);
        case 1:
            return 0.5f;
        case 2:
            return std::ldexp(1.0f, -1 - static_cast<int>(random.below(149)));
        case 3:
            return static_cast<float>(
                std::ldexp(random.real(1, 2), -1 - static_cast<int>(random.below(140))));
        default:
            return std::min(static_cast<float>(random.real(0, 1)), std::nextafter(1.0f, 0.0f));
    }
}

struct Interval {
    double lower;
    double upper;
};

constexpr Interval kIntervals[] = {
    {-1, 1},           {0, 1},       {1, 2},         {1e7, 1e7 + 3}, {-1e7, -9.9e6},
    {-7e5, 1},         {0.3, 0.9},   {0.3, 0.8},     {1, 2.9},       {1, 2.9001},
    {16777216, 2e7},   {-1.1, 0.9},  {5e29, 5.1e29}, {1e-45, 1e-3},  {-1e-20, -9e-21},
    {-1e-39, 1e-39},   {0, 1e-44},   {1e-42, 3e-42}, {-3e38, 3e38},  {1e38, 3.4e38},
    {-8.5e37, 8.5e37}, {3.25, 3.25}, {1e-30, 2e-30}, {-1e-9, 1e-9},  {5e-10, 1e-9},
};

ListedClip clip_in(const Interval& x, const Interval& y, std::uint64_t seed) {
    Random random(seed);
    std::vector<std::vector<vec3>> keyframes(2);
    for (std::vector<vec3>& keyframe : keyframes) {
        for (int i = 0; i < 60; ++i) {
            keyframe.emplace_back(coordinate(random, x.lower, x.upper),
                                  coordinate(random, y.lower, y.upper),
                                  coordinate(random, 0.25 * x.lower, 0.25 * x.upper));
        }
    }
    // Now and then nothing moves.
    std::copy_n(keyframes[0].begin(), 5, keyframes[1].begin());
    return {{}, keyframes};
}

TEST(SceneKeyframes, GiveTheBitsOfWorldSpaceIfTheyAreUsable) {
    Random random(7);
    std::size_t usable = 0;
    std::size_t all = 0;
    for (const Interval& x : kIntervals) {
        for (const Interval& y : kIntervals) {
            const ListedClip clip = clip_in(x, y, ++all);
            const SceneSpace space(clip.bounds());
            const SceneKeyframes keyframes(clip, space);
            if (!keyframes.blend(0.5)) continue;
            ++usable;
            for (int i = 0; i < 60; ++i) {
                const KeyframeBlend blend = {0, 1, part(random)};
                const std::vector<vec3> expected = expected_pose(clip, space, blend);
                const auto where = [&] {
                    return ::testing::Message() << x.lower << ".." << x.upper << ", " << y.lower
                                                << ".." << y.upper << ", " << blend.f;
                };
                ASSERT_EQ(differences(by_keyframes(keyframes, clip, blend), expected), 0u)
                    << where();
            }
        }
    }
    EXPECT_GT(usable, all / 2);
    EXPECT_LT(usable, all);
}

TEST(SceneKeyframes, GiveKeyframesThemselves) {
    const ListedClip clip = clip_in({1e7, 1e7 + 3}, {-1, 1}, 1);
    const SceneSpace space(clip.bounds());
    const SceneKeyframes keyframes(clip, space);
    for (const std::size_t k : {0, 1}) {
        const KeyframeBlend blend = {k, k, 0};
        EXPECT_EQ(keyframes.blend(static_cast<double>(k)), blend);
        EXPECT_EQ(
            differences(by_keyframes(keyframes, clip, blend), expected_pose(clip, space, blend)),
            0u);
    }
}

TEST(SceneKeyframes, KnowNoPlaceForVerticesThatAreNotFiniteInEitherKeyframe) {
    std::vector<std::vector<vec3>> lists(2, std::vector<vec3>(8, vec3(1, 2, 3)));
    lists[0][0].x = kNan;
    lists[1][1].y = kInfinity;
    lists[0][2].z = -kInfinity;
    lists[0][3] = lists[1][3] = vec3(kInfinity, kNan, 1);
    lists[1][4] = vec3(-5, -5, -5);
    const ListedClip clip({}, lists);
    const SceneSpace space(clip.bounds());
    const SceneKeyframes keyframes(clip, space);
    for (const float f : {0.5f, 1e-45f, std::nextafter(1.0f, 0.0f)}) {
        const std::vector<vec3> pose = by_keyframes(keyframes, clip, {0, 1, f});
        for (int i = 0; i < 4; ++i) EXPECT_EQ(pose[i].x, kInvalidCoordinate) << i;
        EXPECT_EQ(differences(pose, expected_pose(clip, space, {0, 1, f})), 0u);
    }
    EXPECT_EQ(differences(by_keyframes(keyframes, clip, {1, 1, 0}),
                          expected_pose(clip, space, {1, 1, 0})),
              0u);
}

TEST(SceneKeyframes, AreOfNoUseWhereUnitsDoNotCommute) {
    const auto usable = [](double lower, double upper) {
        const ListedClip clip = clip_in({lower, upper}, {lower, upper}, 3);
        return SceneKeyframes(clip, SceneSpace(clip.bounds())).blend(0.5).has_value();
    };
    EXPECT_TRUE(usable(-1, 1));
    EXPECT_TRUE(usable(-0x1p-30, 0x1p-30));
    EXPECT_FALSE(usable(-0x1p-31, 0x1p-31));
    EXPECT_TRUE(usable(-0x1p126, 0x1p126));
    EXPECT_FALSE(usable(-0x1.1p126, 0x1.1p126));
    const ListedClip nothing({}, {{vec3(kNan, 0, 0)}, {vec3(0, kNan, 0)}});
    EXPECT_FALSE(SceneKeyframes(nothing, SceneSpace(nothing.bounds())).blend(0.5));
}

}  // namespace
}  // namespace mray
