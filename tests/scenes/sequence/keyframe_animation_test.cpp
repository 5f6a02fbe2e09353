#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "scenes/animation.h"
#include "scenes/sequence/streamed_animation.h"
#include "tests/support/animation_positions.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

// A triangle at x, moved by frame.
std::string triangle_at(const std::string& x) {
    return "v " + x + " 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
}

struct Opened {
    /// The files are read when frames need them.
    std::unique_ptr<TemporaryFolder> folder = std::make_unique<TemporaryFolder>();
    std::unique_ptr<Animation> animation;
    std::vector<std::string> warnings;
};

Opened open_frames(const std::vector<std::string>& texts, AnimationOptions options = {}) {
    Opened opened;
    for (std::size_t i = 0; i < texts.size(); ++i) {
        if (!texts[i].empty()) opened.folder->write(fmt::format("f_{}.obj", i), texts[i]);
    }
    options.warn = [&](const Warning& warning) { opened.warnings.push_back(warning.line()); };
    opened.animation = open_scene((opened.folder->path() / "f_%d.obj").native(), options);
    return opened;
}

float x_at(const Opened& opened, double frame) {
    return positions_at(*opened.animation, frame)[0].x;
}

TEST(KeyframeAnimation, GivesKeyframesBitForBitAndInterpolatesBetween) {
    const Opened opened = open_frames({triangle_at("0.1"), triangle_at("1e-42"), triangle_at("4")});
    EXPECT_EQ(opened.animation->first_frame(), 0);
    EXPECT_EQ(opened.animation->last_frame(), 2);
    EXPECT_EQ(x_at(opened, 0), 0.1f);
    EXPECT_EQ(std::bit_cast<unsigned>(x_at(opened, 1)), 714u);
    EXPECT_EQ(x_at(opened, 1.25), 1e-42f + (4.0f - 1e-42f) * 0.25f);
    EXPECT_EQ(x_at(opened, 0.7), 0.1f + (1e-42f - 0.1f) * 0.7f);
    EXPECT_EQ(x_at(opened, 2), 4.0f);
    EXPECT_EQ(x_at(opened, std::nextafter(2.0, 0.0)), 4.0f);
    // 1 + (1e-9 - 1) is 0 in float.
    const Opened shrinking = open_frames({triangle_at("1"), triangle_at("1e-9")});
    EXPECT_EQ(x_at(shrinking, std::nextafter(1.0, 0.0)), 1e-9f);
}

TEST(KeyframeAnimation, IsSmoothOverVerticesOrAsTheFirstFileSays) {
    const Opened without = open_frames({triangle_at("0"), triangle_at("1")});
    EXPECT_EQ(without.animation->smooth_corners().data(),
              without.animation->topology().triangles.data());
    // A square and a triangle at its edge 2 3, with a crease there at vertex 3 only.
    const std::string both =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 1\nvn 0 0 1\nvn 1 0 0\n"
        "f 1//1 2//1 3//1 4//1\nf 2//1 5//2 3//2\n";
    const Opened given = open_frames({both, both});
    const Topology& topology = given.animation->topology();
    const std::span<const uvec3> smooth = given.animation->smooth_corners();
    ASSERT_EQ(smooth.size(), 3u);
    const auto number = [&](std::size_t prim, std::uint32_t vertex) {
        for (int k = 0; k < 3; ++k)
            if (topology.triangles[prim][k] == vertex) return smooth[prim][k];
        return ~0u;
    };
    // The same in both triangles of the square.
    for (const std::uint32_t vertex : {0u, 1u, 2u, 3u}) {
        const std::uint32_t first = number(0, vertex);
        const std::uint32_t second = number(1, vertex);
        if (first != ~0u && second != ~0u) {
            EXPECT_EQ(first, second);
        }
    }
    const auto in_square = [&](std::uint32_t vertex) {
        return std::min(number(0, vertex), number(1, vertex));
    };
    EXPECT_EQ(number(2, 1), in_square(1));
    EXPECT_NE(number(2, 2), in_square(2));
}

TEST(Interpolate, NeverLeavesTheInterval) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> mantissa(-2, 2);
    std::uniform_int_distribution<int> exponent(-149, 99);
    std::uniform_real_distribution<float> unit(0, 1);
    const float nearly_one = std::nextafter(1.0f, 0.0f);
    for (int i = 0; i < 2'000'000; ++i) {
        const int scale = exponent(random);
        const float a = std::ldexp(mantissa(random), scale);
        const float b = std::ldexp(mantissa(random), i % 2 ? scale : exponent(random));
        const float f = i % 3 == 0 ? nearly_one : std::min(unit(random), nearly_one);
        const float x = interpolate(a, b, f);
        ASSERT_GE(x, std::min(a, b)) << a << " " << b << " " << f;
        ASSERT_LE(x, std::max(a, b)) << a << " " << b << " " << f;
    }
}

TEST(KeyframeAnimation, ColoursAndTrianglesAreThoseOfTheFirstFrame) {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl a\nKd 1 0 0\n");
    const std::string quad = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nusemtl a\nf 1 2 3 4\nf 1 2 3\n";
    // In the second frame the notch is elsewhere: the same faces, but another triangulation.
    const std::string moved = "v 0 0 0\nv 1 1 0\nv 4 4 0\nv 0 4 0\nf 1 2 3 4\nf 1 2 3\n";
    folder.write("f_0.obj", "mtllib a.mtl\n" + quad);
    folder.write("f_1.obj", moved);
    const auto animation = open_scene(folder.path().native());
    EXPECT_EQ(animation->topology().albedo, (std::vector<Albedo>{0xFF, 0xFF, 0xFF}));
    EXPECT_EQ(animation->topology().triangles.size(), 3u);
    EXPECT_EQ(animation->topology().triangles[2], uvec3(0, 1, 2));
}

TEST(KeyframeAnimation, FrameOfOtherVertexCountIsRefusedByName) {
    const auto error = error_of([] {
        x_at(open_frames({triangle_at("0"), triangle_at("1"), "v 0 0 0\n" + triangle_at("2")}), 2);
    });
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
    EXPECT_NE(
        std::string(error->what()).find("f_2.obj: frame 2 has other faces (1 of 4 vertices) than "),
        std::string::npos)
        << error->what();
    EXPECT_NE(std::string(error->what()).find("separate runs"), std::string::npos);
}

TEST(KeyframeAnimation, FrameOfTheSameCountsButOtherFacesIsRefusedByName) {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
    const std::string message = message_of([&] {
        x_at(open_frames({vertices + "f 1 2 3\nf 2 4 3\n", vertices + "f 1 2 3\nf 3 2 4\n"}), 1);
    });
    EXPECT_NE(message.find("f_1.obj: frame 1 has other faces (2 of 4 vertices) than "),
              std::string::npos)
        << message;
    EXPECT_NE(message_of([&] {
                  x_at(open_frames({vertices + "f 1 2 3\n", vertices + "f 1 2 3\nf 3 2 4\n"}), 1);
              }).find("other faces (2 of 4 vertices) than "),
              std::string::npos);
    EXPECT_NE(message_of([&] {
                  x_at(open_frames(
                           {vertices + "f 1 2 3 4\nf 1 2 3\n", vertices + "f 1 2 3\nf 4 1 2 3\n"}),
                       1);
              }).find("other faces"),
              std::string::npos);
}

TEST(KeyframeAnimation, FrameThatExplodesFailsWhenItIsAskedFor) {
    for (const char* x : {"nan", "inf", "1e31", "-3e38", "x"}) {
        const Opened opened = open_frames({triangle_at("0"), triangle_at("1"), triangle_at(x),
                                           triangle_at("3"), triangle_at("4")});
        EXPECT_EQ(x_at(opened, 0), 0.0f);
        EXPECT_EQ(x_at(opened, 0.5), 0.5f);
        EXPECT_EQ(x_at(opened, 1), 1.0f);
        for (const double frame : {1.5, 2.0, 2.75}) {
            const auto error = error_of([&] { x_at(opened, frame); });
            ASSERT_TRUE(error) << frame;
            EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
            EXPECT_NE(std::string(error->what()).find("f_2.obj:1: "), std::string::npos);
            EXPECT_NE(std::string(error->what()).find(": frame 2: "), std::string::npos);
        }
        EXPECT_EQ(x_at(opened, 3), 3.0f);
        EXPECT_EQ(x_at(opened, 3.5), 3.5f);
        EXPECT_TRUE(opened.warnings.empty());
    }
}

TEST(KeyframeAnimation, MissingFrameIsRefusedOrInterpolated) {
    const std::vector<std::string> texts = {triangle_at("0"), "", "", triangle_at("6"),
                                            triangle_at("7")};
    EXPECT_EQ(kind_of([&] { open_frames(texts); }), ErrorKind::kBadInput);
    AnimationOptions options;
    options.skip_missing = true;
    const Opened skipped = open_frames(texts, options);
    EXPECT_EQ(skipped.animation->last_frame(), 4);
    EXPECT_EQ(x_at(skipped, 1.5), 3.0f);
    EXPECT_EQ(x_at(skipped, 3.5), 6.5f);
}

}  // namespace
}  // namespace mray
