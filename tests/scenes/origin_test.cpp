// Coordinates that lie so far from 0 that floats are too coarse for them.
#include "common/scene/scene_space.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/text/text.h"
#include "scenes/animation.h"
#include "tests/scenes/ply/ply_files.h"
#include "tests/support/temporary_folder.h"

namespace mray {
namespace {

using namespace test;

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
    EXPECT_NE(warnings[0].text.find("far from the first"), std::string::npos);
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
