#include "scenes/animation.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/scene_space.h"
#include "common/text/text.h"
#include "scenes/mesh/mesh_file.h"
#include "tests/scenes/ply/ply_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST(OpenScene, OpensAFile) {
    const TemporaryFolder folder;
    const std::string path = folder.write("a.obj", kTriangle).native();
    const auto animation = open_scene(path);
    EXPECT_EQ(animation->name(), path);
    EXPECT_EQ(animation->topology().vertex_count, 3u);
    EXPECT_EQ(animation->topology().triangles, std::vector<uvec3>{uvec3(0, 1, 2)});
    EXPECT_EQ(animation->topology().albedo, std::vector<Albedo>{kClay});
    EXPECT_EQ(animation->first_frame(), 0);
    EXPECT_EQ(animation->last_frame(), 0);
}

TEST(OpenScene, NameOfABuiltinSceneWithoutItsPrefixGivesAHint) {
    for (const char* spec : {"cloth", "twist:5000"}) {
        const auto error = error_of([&] { open_scene(spec); });
        ASSERT_TRUE(error);
        EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
        EXPECT_TRUE(has(error->what(), fmt::format("did you mean builtin:{}?", spec)));
    }
}

TEST(OpenScene, FileThatIsThereIsNoPattern) {
    const TemporaryFolder folder;
    EXPECT_EQ(open_scene(folder.write("100%.obj", kTriangle).native())->last_frame(), 0);
}

TEST(OpenScene, BadSpecsAreUsageErrorsAndWhatIsNoSceneIsBadInput) {
    const TemporaryFolder folder;
    folder.write("a.png", kTriangle);
    folder.write("a.obj", "");
    fs::create_symlink("loop.obj", folder.path() / "loop.obj");
    fs::resize_file(folder.write("huge.obj", ""), (std::uint64_t{4} << 30) + 1);
    const auto expect = [](const std::string& spec, ErrorKind kind) {
        EXPECT_EQ(kind_of([&] { open_scene(spec); }), kind) << spec;
    };
    for (const char* pattern :
         {"%s.obj", "%n.obj", "%d%d.obj", "%99999999d.obj", "100%", "*_*.obj", "*/f.obj"})
        expect(folder.file(pattern), ErrorKind::kBadArgument);
    for (const char* spec : {"", "builtin:", "builtin:no such scene", "builtin:x:0", "builtin:x:-1",
                             "builtin:x:1e6", "builtin:x:", "builtin:x:1:2", "builtin:x:nan"})
        expect(spec, ErrorKind::kBadArgument);
    for (const char* name : {"none.obj", "", "a.png", "a.obj", "loop.obj"})
        expect(folder.file(name), ErrorKind::kBadInput);
    for (const std::string& spec : {std::string("/dev/zero"), std::string(10'000, 'x')})
        expect(spec, ErrorKind::kBadInput);
    expect(folder.file("huge.obj"), ErrorKind::kLimit);
}

TEST(OpenScene, BuiltinOfNoNumberOfTrianglesIsToldOneThatOpens) {
    for (const char* spec : {"builtin:herd:abc", "builtin:herd:0",
                             "builtin:herd:", "builtin:no such scene:abc", "builtin:\n:abc"}) {
        const std::string message = message_of([&] { open_scene(spec); });
        EXPECT_TRUE(message.ends_with("such as builtin:cloth:100000")) << message;
    }
    EXPECT_NO_THROW(open_scene("builtin:cloth:100000"));
}

const std::vector<std::vector<double>> kFar = {{528980.85, 183526.1, 10.0},
                                               {528985.85, 183526.1, 10.0},
                                               {528980.85, 183531.1, 15.0},
                                               {528985.85, 183531.1, 15.0}};

std::string obj(double shift) {
    std::string text;
    for (const auto& p : kFar) text += fmt::format("v {} {} {}\n", p[0] + shift, p[1], p[2]);
    return text + "f 1 2 3\nf 2 4 3\n";
}

void expect_far(const Animation& animation, double frame, double shift) {
    std::vector<vec3> world(kFar.size());
    animation.positions(frame, world);
    for (std::size_t i = 0; i < kFar.size(); ++i) {
        const glm::dvec3 file = animation.origin().from_world(glm::dvec3(world[i]));
        EXPECT_NEAR(file.x, kFar[i][0] + shift, 1e-6);
        EXPECT_NEAR(file.y, kFar[i][1], 1e-6);
        EXPECT_NEAR(file.z, kFar[i][2], 1e-6);
    }
}

TEST(Origin, MeshesFarFromZeroKeepTheirDigits) {
    const TemporaryFolder folder;
    expect_far(*open_scene(folder.write("a.obj", obj(0))), 0, 0);
    for (const PlyEncoding encoding : kPlyEncodings) {
        const std::string bytes =
            ply(encoding, {ply_vertices(kFar, "double"), ply_faces({{3, 0, 1, 2}, {3, 1, 3, 2}})});
        expect_far(*open_scene(folder.write(ply_format(encoding) + ".ply", bytes)), 0, 0);
    }
}

TEST(Origin, AllFramesHaveThatOfTheFirst) {
    const TemporaryFolder folder;
    folder.write("a/f_0.obj", obj(0));
    folder.write("a/f_1.obj", obj(2));
    folder.write("a/f_2.obj", obj(1234.56));
    folder.write("a/f_3.obj", obj(2345.67));
    std::vector<Warning> warnings;
    const auto animation =
        open_scene(folder.file("a"), {.warn = [&](const Warning& w) { warnings.push_back(w); }});
    expect_far(*animation, 1, 2);
    EXPECT_TRUE(warnings.empty());
    std::vector<vec3> world(kFar.size());
    animation->positions(2, world);
    animation->positions(3, world);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_TRUE(has(warnings[0].text, "far from the first"));
}

TEST(Origin, IsZeroWhereFloatsHaveTheDigits) {
    const glm::dvec3 at(0.1, 0.2, 0.3);
    for (const double scale : {1e-42, 1e-30, 1.0, 1e20})
        EXPECT_EQ(origin_of(std::vector{at * scale, at * scale * 2.0}), Origin()) << scale;
    // Floats, however far.
    const glm::dvec3 far(528980.875, 0, 0);
    EXPECT_EQ(origin_of(std::vector{far, far + glm::dvec3(0.125)}), Origin());
    EXPECT_EQ(origin_of(std::vector{far + at}), Origin());
    EXPECT_EQ(origin_of({}), Origin());
    const double nan = std::nan("");
    EXPECT_EQ(origin_of(std::vector{far + at, far + at * 9.0, glm::dvec3(nan), glm::dvec3(1e31)}),
              origin_of(std::vector{far + at, far + at * 9.0}));
    EXPECT_NE(origin_of(std::vector{far + at, far + at * 9.0}), Origin());
}

TEST(Origin, CoordinatesRoundToTheNearestFloatOfTheirText) {
    for (const char* text :
         {"0.1", "1e-42", "1.000000059604644775390626", "1.000000059604644775390625",
          "-1.000000178813934326171874", "1.1e-45", "7.0064923216240853546186479164496e-46",
          "7.0064923216240853546186479164497e-46", "3", "-0", "1e39", "-inf"}) {
        const float expected = parse_float(text).value();
        const double number = parse_coordinate(text).value();
        EXPECT_EQ(Origin().to_world({number, 0, 0}).x, expected) << text;
        EXPECT_DOUBLE_EQ(number, parse_double(text).value()) << text;
    }
    EXPECT_FALSE(parse_coordinate("1,5"));
}

}  // namespace
}  // namespace mray
