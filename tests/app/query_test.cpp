// Points against geometry whose answers are known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Words = std::vector<std::string>;

Outcome query(const std::string& scene, const std::string& points, Words more) {
    Words all = {"query", scene, "--points", "-"};
    all.insert(all.end(), more.begin(), more.end());
    return run(all, {.input = points});
}

TEST(Query, AnswersComeInTheOrderAsked) {
    TemporaryFolder folder;
    const std::string scene = folder.write("cube.obj", cube());
    for (const char* backend : {"cpu", "brute"}) {
        const Outcome outcome = query(scene, "0.25 0.5 0.125\n# outside\n3 0.25 0.5\n1 0.25 0.5\n",
                                      {"--ask", "distance,inside,winding", "--backend", backend});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
        EXPECT_EQ(lines(outcome.out).at(0), "-0.5 1 1");
        EXPECT_EQ(lines(outcome.out).at(1), "2 0 0");
        EXPECT_TRUE(lines(outcome.out).at(2).starts_with("0 1 ")) << outcome.out;
    }
}

TEST(Query, ClosestPointIsNamedWithItsFeature) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle());
    const Outcome outcome = query(scene, "0.25 0.5 2\n0.5 -1 0\n-3 -4 0\n", {"--ask", "closest"});
    EXPECT_EQ(outcome.out,
              "0.25 0.5 0 2 0 0.25 0.5 face\n0.5 0 0 1 0 0.5 0 edge\n0 0 0 5 0 0 0 vertex\n");
    EXPECT_EQ(
        query(scene, "0.25 0.5 2\n0.5 -1 0\n", {"--ask", "closest", "--max-distance", "1.5"}).out,
        "- - - inf - - - -\n0.5 0 0 1 0 0.5 0 edge\n");
}

TEST(Query, WarnsOnceOfAnOpenMesh) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle());
    const Outcome outcome = query(scene, "0 0 1\n0 0 2\n", {"--ask", "inside,distance"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.err.find("3 open"), std::string::npos) << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_EQ(query(scene, "0 0 1\n", {"--ask", "closest"}).err, "");
}

TEST(Query, WarnsOfAMeshWhoseTrianglesAreThereInBothDirections) {
    TemporaryFolder folder;
    const std::string doubled =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        "f 2 3 1\nf 4 2 1\nf 3 4 1\nf 4 3 2\n";
    const std::string scene = folder.write("doubled.obj", doubled);
    const Outcome outcome = query(scene, "0.25 0.25 0.125\n", {"--ask", "inside,winding"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "0 0\n");
    EXPECT_NE(outcome.err.find("8 triangles have a twin"), std::string::npos) << outcome.err;
    EXPECT_NE(run({"info", scene, "--json", "-"}).out.find("\"twins\": 8"), std::string::npos);
    EXPECT_EQ(query(scene, "0 0 1\n", {"--ask", "closest"}).err, "");
}

TEST(Query, DistanceBeyondTheLargestIsInfiniteWithItsSign) {
    TemporaryFolder folder;
    const std::string scene = folder.write("c.obj", cube(2));
    const std::string points = "0.5 0 0\n0 0 0\n0 1.5 0\n0 3 0\n";
    const Outcome all = query(scene, points, {"--ask", "distance"});
    const std::vector<std::string> distances = lines(all.out);
    const Outcome near = query(scene, points, {"--ask", "distance", "--max-distance", "0.5"});
    ASSERT_EQ(distances.size(), 4u);
    for (std::size_t i = 0; i < distances.size(); ++i) {
        const double distance = std::stod(distances[i]);
        const std::string expected = std::abs(distance) <= 0.5 ? distances[i]
                                     : distance < 0            ? "-inf"
                                                               : "inf";
        EXPECT_EQ(lines(near.out).at(i), expected) << distance;
    }
}

TEST(Query, RuleDecidesWhereMeshesOverlap) {
    TemporaryFolder folder;
    std::string two = cube(2);
    for (const std::string& line : lines(cube(1))) {
        // The faces of the second cube count on from the vertices of the first.
        std::istringstream in(line);
        std::string word;
        in >> word;
        two += word;
        const bool is_face = word == "f";
        while (in >> word) two += is_face ? fmt::format(" {}", std::stoi(word) + 8) : ' ' + word;
        two += '\n';
    }
    const std::string scene = folder.write("cubes.obj", two);
    const std::string points = "0.1 0.2 0.3\n1.5 0.2 0.3\n";
    EXPECT_EQ(query(scene, points, {"--ask", "winding,inside"}).out, "2 1\n1 1\n");
    EXPECT_EQ(query(scene, points, {"--ask", "winding,inside", "--rule", "odd"}).out, "2 0\n1 1\n");
    EXPECT_EQ(query(scene, "0.25 0 0\n", {"--ask", "distance", "--rule", "odd"}).out, "0.75\n");
}

TEST(Query, PointThatIsNotFiniteIsOutsideAndWarnedAbout) {
    TemporaryFolder folder;
    const std::string scene = folder.write("c.obj", cube());
    const Outcome outcome = query(scene, "nan 0 0\n", {"--ask", "inside,winding,distance,closest"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "0 0 nan - - - inf - - - -\n");
    ASSERT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find("<stdin>: warning: 1 of 1 points are not finite"), std::string::npos)
        << outcome.err;
}

TEST(Query, SyntaxErrorNamesFileAndLine) {
    TemporaryFolder folder;
    const std::string scene = folder.write("cube.obj", cube());
    const std::string out = folder.file("answers");
    for (const char* line : {"1 2", "1", "1 2 3 4", "1 2 x", "1,5 2 3"}) {
        const std::string points = folder.write("points", std::string("0 0 0\n#\n") + line);
        const Outcome outcome =
            run({"query", scene, "--points", points, "--ask", "inside", "--out", out});
        EXPECT_EQ(outcome.code, 3) << line;
        EXPECT_TRUE(outcome.err.starts_with(points + ":3: ")) << outcome.err;
        EXPECT_TRUE(outcome.err.ends_with("write `x y z`\n")) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(out)) << line;
    }
}

TEST(Query, FacesThatCannotBeReadAreNotLeftOutSilently) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle() + "v nan 0 1\nf 1 2 4\n");
    EXPECT_EQ(query(scene, "0 0 1\n", {"--ask", "distance"}).code, 3);
    const Outcome lenient = query(scene, "0 0 1\n", {"--ask", "distance", "--lenient"});
    EXPECT_EQ(lenient.out, "1\n");
    EXPECT_NE(lenient.err.find("1 of 2 triangles are not finite"), std::string::npos)
        << lenient.err;
}

/// A box of 5 m in coordinates of UTM.
std::string utm_box() {
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += fmt::format("v {} {} {}\n", (i & 1) != 0 ? 528985.85 : 528980.85,
                            (i & 2) != 0 ? 183531.1 : 183526.1, (i & 4) != 0 ? 15 : 10);
    return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

TEST(Query, CoordinatesFarFromZeroKeepTheirDigits) {
    TemporaryFolder folder;
    const std::string scene = folder.write("box.obj", utm_box());
    const Outcome outcome = query(scene, "528980.851 183528.1 12.5\n528980.849 183528.1 12.5\n",
                                  {"--ask", "inside,distance,closest"});
    ASSERT_EQ(lines(outcome.out).size(), 2u) << outcome.err;
    for (std::size_t i = 0; i < 2; ++i) {
        std::istringstream words(lines(outcome.out)[i]);
        int inside = 0;
        double distance = 0;
        double x = 0;
        words >> inside >> distance >> x;
        EXPECT_EQ(inside, i == 0 ? 1 : 0);
        EXPECT_NEAR(distance, i == 0 ? -0.001 : 0.001, 1e-6) << outcome.out;
        EXPECT_NEAR(x, 528980.85, 1e-6) << outcome.out;
    }
    EXPECT_EQ(outcome.err, "");
}

TEST(Query, RaysAndViewsHaveTheCoordinatesOfTheFile) {
    TemporaryFolder folder;
    const std::string scene = folder.write("box.obj", utm_box());
    const Outcome hit = run({"trace", scene, "--rays", "-", "--out", "-"},
                            {.input = "528970.85 183528.1 12.5 1 0 0\n"});
    std::istringstream words(hit.out);
    std::string mark;
    double t = 0;
    words >> mark >> t;
    EXPECT_EQ(mark, "H") << hit.err;
    EXPECT_NEAR(t, 10, 1e-5) << hit.out;
    const Outcome probe =
        run({"probe", scene, "--frame", "0", "--pixel", "8,8", "--size", "16x16", "--eye",
             "528970.85,183528.6,12.5", "--target", "528990.85,183528.6,12.5"});
    EXPECT_NE(probe.out.find("10 away"), std::string::npos) << probe.out << probe.err;
    EXPECT_NE(probe.out.find("(528970.85"), std::string::npos) << probe.out;
    const Outcome info = run({"info", scene});
    EXPECT_NE(info.out.find("(528980.85"), std::string::npos) << info.out;
    EXPECT_NE(info.out.find("origin"), std::string::npos) << info.out;
}

}  // namespace
}  // namespace mray::test
