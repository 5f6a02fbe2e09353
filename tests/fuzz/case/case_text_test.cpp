// Cases as text and as files of the program.
#include "tests/fuzz/case/case_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <limits>

#include "app/cli/command_line.h"
#include "clips/source/open_scene.h"
#include "common/base/errors.h"
#include "tests/fuzz/generate/calls.h"
#include "tests/fuzz/generate/generator.h"
#include "tests/fuzz/shrink/reproducer.h"
#include "tests/support/temporary_folder.h"

namespace mray::fuzz {
namespace {

std::vector<std::uint32_t> bits_of(const std::vector<vec3>& positions) {
    std::vector<std::uint32_t> bits;
    for (const vec3& p : positions)
        for (int axis = 0; axis < 3; ++axis) bits.push_back(std::bit_cast<std::uint32_t>(p[axis]));
    return bits;
}

/// Every kind of float there is.
FuzzCase special_case() {
    using Limits = std::numeric_limits<float>;
    FuzzCase special;
    special.cause = "all kinds of floats";
    special.triangles = {{0, 1, 2}};
    special.poses = {{{Limits::quiet_NaN(), -Limits::infinity(), -0.0f},
                      {std::bit_cast<float>(0xFFC12345u), Limits::denorm_min(), Limits::max()},
                      {-Limits::denorm_min(), 0.1f, 1e-40f}}};
    special.view.width = 3;
    special.view.height = 257;
    special.view.eye = Point{-0.0, 5e-324, 0.1};
    special.view.fov = 1e-4;
    special.rays = {{{1, 2, 3}, {0, -0.0, 1e-300}, 0, std::numeric_limits<double>::infinity()}};
    special.asks_questions = true;
    special.points = {special.poses[0][0], special.poses[0][1], {1, -2, 1e-40f}};
    return special;
}

TEST(CaseText, ReadsBackBitForBit) {
    const FuzzCase special = special_case();
    const FuzzCase read = read_case(to_text(special, "a remark\nof two lines"), "special");
    EXPECT_EQ(bits_of(read.poses[0]), bits_of(special.poses[0]));
    EXPECT_TRUE(std::signbit((*read.view.eye)[0]));
    EXPECT_EQ(std::memcmp(read.rays.data(), special.rays.data(), sizeof(WorldRay)), 0);
    EXPECT_TRUE(read.asks_questions);
    EXPECT_EQ(bits_of(read.points), bits_of(special.points));
    EXPECT_EQ(to_text(read), to_text(special));
}

TEST(CaseText, OfGeneratedCasesReadsBack) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const FuzzCase made = make_case(seed);
        const FuzzCase read = read_case(to_text(made), "made");
        ASSERT_EQ(to_text(read), to_text(made)) << seed;
        for (std::size_t pose = 0; pose < made.poses.size(); ++pose)
            ASSERT_EQ(bits_of(read.poses[pose]), bits_of(made.poses[pose])) << seed;
    }
}

TEST(CaseText, OfCallsReadsBack) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const FuzzCase made = make_calls(seed);
        ASSERT_FALSE(made.calls.empty());
        ASSERT_EQ(read_case(to_text(made, "a remark"), "made").calls, made.calls) << seed;
        ASSERT_EQ(make_calls(seed).calls, made.calls) << seed;
    }
}

TEST(CaseText, NamesTheLineOfWhatItCannotRead) {
    for (const char* text : {"size 4 4\nsize 4", "cause x\nv 1 2 3", "# x\nfov 1x", "t 0 0 0\nw 1",
                             "cause x\ncall walk 0 0 1", "cause x\ncall update 9 0 1"}) {
        try {
            read_case(text, "broken.txt");
            FAIL() << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kBadInput);
            EXPECT_TRUE(std::string(error.what()).starts_with("broken.txt:2: ")) << error.what();
        }
    }
}

TEST(Generator, IsAFunctionOfTheSeed) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        ASSERT_EQ(to_text(make_case(seed)), to_text(make_case(seed)));
        ASSERT_EQ(to_text(make_questions(seed)), to_text(make_questions(seed)));
    }
    EXPECT_NE(to_text(make_case(1)), to_text(make_case(2)));
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

TEST(Reproducer, HasPositionsThatTheProgramReadsBackBitForBit) {
    const test::TemporaryFolder folder;
    for (const FuzzCase& one : {special_case(), make_case(3), make_case(4)}) {
        const std::filesystem::path path = folder.write("mesh.obj", obj_text(one, 0));
        ClipOptions options;
        options.lenient = options.allow_empty = true;
        options.warn = [](const Warning&) {};
        const std::unique_ptr<Clip> clip = open_scene(path.string(), options);
        std::vector<vec3> read(clip->topology().vertex_count);
        clip->positions(0, read);
        ASSERT_EQ(read.size(), one.poses[0].size());
        EXPECT_EQ(clip->topology().triangles, one.triangles);
        for (std::size_t i = 0; i < read.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                const float expected = one.poses[0][i][axis];
                if (std::isnan(expected)) {
                    EXPECT_TRUE(std::isnan(read[i][axis]));
                } else {
                    EXPECT_EQ(std::bit_cast<std::uint32_t>(read[i][axis]),
                              std::bit_cast<std::uint32_t>(expected));
                }
            }
        }
    }
}

TEST(Reproducer, HasACommandLineThatTheProgramTakes) {
    Variant variant;
    variant.arguments = "--backend cpu --simd off --threads 2";
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const FuzzCase made = make_case(seed);
        const auto arguments = crosscheck_arguments(made, variant, "out/fuzz/a case");
        const auto parsed = app::parse_command_line(arguments);
        ASSERT_TRUE(parsed.options.has_value());
        const ViewSpec& view = parsed.options->view;
        EXPECT_EQ(parsed.options->scenes, std::vector<std::string>{"out/fuzz/a case"});
        EXPECT_EQ(view.eye, made.view.eye);
        EXPECT_EQ(view.target, made.view.target);
        // The program refuses what has no effect.
        if (view.rays == kRaysShadow) {
            EXPECT_EQ(view.light, made.view.light);
        }
        EXPECT_EQ(view.up, made.view.up);
        EXPECT_EQ(view.fov, made.view.fov);
        EXPECT_EQ(view.width, made.view.width);
        EXPECT_EQ(view.height, made.view.height);
        EXPECT_EQ(view.rays, made.view.rays);
        if (view.rays == kRaysAo) {
            EXPECT_EQ(view.ao_count, made.view.ao_count);
            EXPECT_EQ(view.ao_distance, made.view.ao_distance);
        }
        EXPECT_EQ(parsed.options->frames, fmt::format("{}", made.frame));
    }
}

}  // namespace
}  // namespace mray::fuzz
