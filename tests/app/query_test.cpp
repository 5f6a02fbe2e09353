// Points against geometry whose answers are known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

/// The answers about points and a scene of this OBJ text.
Outcome query(const std::string& obj, const std::string& points, const Words& more) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", obj);
    return run(words("query " + scene + " --points -", more), {.input = points});
}

TEST(Query, AnswersComeInTheOrderAsked) {
    for (const char* backend : {"cpu", "brute"}) {
        const Outcome outcome = query(cube(), "0.25 0.5 0.125\n# outside\n3 0.25 0.5\n1 0.25 0.5\n",
                                      {"--ask", "distance,inside,winding", "--backend", backend});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
        EXPECT_EQ(lines(outcome.out).at(0), "-0.5 1 1");
        EXPECT_EQ(lines(outcome.out).at(1), "2 0 0");
        EXPECT_TRUE(lines(outcome.out).at(2).starts_with("0 1 ")) << outcome.out;
    }
}

/// Two triangles that share an edge, and one that goes through the first.
const char* crossing_triangles() {
    return "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0.2 0.2 -1\nv 0.2 0.2 1\nv 0.3 -1 0\n"
           "f 1 2 3\nf 2 4 3\nf 5 6 7\n";
}

TEST(Query, ListsTrianglesThatCrossAtEachFrame) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", crossing_triangles());
    for (const char* backend : {"cpu", "brute"}) {
        const Outcome outcome =
            run(words("query " + scene + " --ask crossings --backend " + backend));
        EXPECT_EQ(outcome.out, "0 0 0 0 2\n") << outcome.err;
    }
    EXPECT_EQ(run(words("query " + scene + " --ask crossings --count --frames all")).out, "0 1\n");
    EXPECT_NE(run(words("info " + scene + " --crossings")).out.find("1 pairs of triangles"),
              std::string::npos);
    for (const char* wrong : {"--ask crossings,inside", "--ask crossings --points -",
                              "--ask inside --count --points -", "--ask inside"})
        EXPECT_EQ(run(words("query " + scene + " " + wrong)).code, 2) << wrong;
}

TEST(Query, ClosestPointIsNamedWithItsFeature) {
    const Outcome outcome =
        query(unit_triangle(), "0.25 0.5 2\n0.5 -1 0\n-3 -4 0\n", {"--ask", "closest"});
    EXPECT_EQ(outcome.out,
              "0.25 0.5 0 2 0 0.25 0.5 face\n0.5 0 0 1 0 0.5 0 edge\n0 0 0 5 0 0 0 vertex\n");
    EXPECT_EQ(query(unit_triangle(), "0.25 0.5 2\n0.5 -1 0\n",
                    {"--ask", "closest", "--max-distance", "1.5"})
                  .out,
              "- - - inf - - - -\n0.5 0 0 1 0 0.5 0 edge\n");
}

TEST(Query, WarnsOnceOfAnOpenMesh) {
    const Outcome outcome = query(unit_triangle(), "0 0 1\n0 0 2\n", {"--ask", "inside,distance"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_TRUE(has(outcome.err, "3 open"));
    EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_EQ(query(unit_triangle(), "0 0 1\n", {"--ask", "closest"}).err, "");
}

TEST(Query, NamesTheRuleForTurnedTriangles) {
    const std::string turned =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    const auto warning = [&](const Words& more) { return query(turned, "9 9 9\n", more).err; };
    EXPECT_TRUE(has(warning({"--ask", "inside"}), "3 turned; "));
    EXPECT_TRUE(has(warning({"--ask", "inside"}), "; --rule odd is right where"));
    EXPECT_EQ(warning({"--ask", "inside,distance", "--rule", "odd"}), "");
    EXPECT_FALSE(has(warning({"--ask", "winding", "--rule", "odd"}), "--rule"));
    EXPECT_FALSE(has(query(unit_triangle(), "0 0 1\n", {"--ask", "inside"}).err, "--rule"));
}

TEST(Query, ReadsPointsOfNpyFiles) {
    const double points[] = {0.25, 0.5, 2, 0.5, -1, 0};
    std::string npy("\x93NUMPY\x01\x00\x46\x00", 10);
    npy += "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";
    npy.resize(80, ' ');
    npy.append(reinterpret_cast<const char*>(points), sizeof(points));
    EXPECT_EQ(query(unit_triangle(), npy, {"--ask", "distance"}).out, "2\n1\n");
    npy.replace(npy.find("(2, 3)"), 6, "(3, 2)");
    EXPECT_TRUE(
        has(query(unit_triangle(), npy, {"--ask", "distance"}).err, "'<f8' of shape (3,2)"));
}

TEST(Query, WarnsOfAMeshWhoseTrianglesAreThereInBothDirections) {
    TemporaryFolder folder;
    const std::string doubled =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
        "f 2 3 1\nf 4 2 1\nf 3 4 1\nf 4 3 2\n";
    const Outcome outcome = query(doubled, "0.25 0.25 0.125\n", {"--ask", "inside,winding"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "0 0\n");
    EXPECT_TRUE(has(outcome.err, "8 triangles have a twin"));
    EXPECT_TRUE(has(run({"info", folder.write("doubled.obj", doubled), "--json", "-"}).out,
                    "\"twins\": 8"));
    EXPECT_EQ(query(doubled, "0 0 1\n", {"--ask", "closest"}).err, "");
}

TEST(Query, RuleDecidesWhereMeshesOverlap) {
    const std::string points = "0.1 0.2 0.3\n1.5 0.2 0.3\n";
    EXPECT_EQ(query(cube(2) + cube(1), points, {"--ask", "winding,inside"}).out, "2 1\n1 1\n");
    EXPECT_EQ(query(cube(2) + cube(1), points, {"--ask", "winding,inside", "--rule", "odd"}).out,
              "2 0\n1 1\n");
    EXPECT_EQ(query(cube(2) + cube(1), "0.25 0 0\n", {"--ask", "distance", "--rule", "odd"}).out,
              "0.75\n");
    // Beyond the largest distance answers have the sign alone.
    EXPECT_EQ(query(cube(2) + cube(1), "1.5 0 0\n0 0 0\n0 4 0\n",
                    {"--ask", "distance", "--max-distance", "0.75"})
                  .out,
              "-0.5\n-inf\ninf\n");
}

TEST(Query, PointThatIsNotFiniteIsOutsideAndWarnedAbout) {
    const Outcome outcome =
        query(cube(), "nan 0 0\n", {"--ask", "inside,winding,distance,closest"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "0 0 nan - - - inf - - - -\n");
    ASSERT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(has(outcome.err, "<stdin>: warning: 1 of 1 points are not finite"));
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
    const std::string obj = unit_triangle() + "v nan 0 1\nf 1 2 4\n";
    EXPECT_EQ(query(obj, "0 0 1\n", {"--ask", "distance"}).code, 3);
    const Outcome lenient = query(obj, "0 0 1\n", {"--ask", "distance", "--lenient"});
    EXPECT_EQ(lenient.out, "1\n");
    EXPECT_TRUE(has(lenient.err, "1 of 2 triangles are not finite"));
}

/// A box of 5 m in coordinates of UTM.
std::string utm_box() { return box(528980.85, 183526.1, 10, 5); }

TEST(Query, CoordinatesFarFromZeroKeepTheirDigits) {
    const Outcome outcome = query(utm_box(), "528980.851 183528.1 12.5\n528980.849 183528.1 12.5\n",
                                  {"--ask", "inside,distance,closest"});
    ASSERT_EQ(lines(outcome.out).size(), 2u) << outcome.err;
    for (std::size_t i = 0; i < 2; ++i) {
        const Words answers = words(lines(outcome.out)[i]);
        EXPECT_EQ(answers.at(0), i == 0 ? "1" : "0");
        EXPECT_NEAR(std::stod(answers.at(1)), i == 0 ? -0.001 : 0.001, 1e-6) << outcome.out;
        EXPECT_NEAR(std::stod(answers.at(2)), 528980.85, 1e-6) << outcome.out;
    }
    EXPECT_EQ(outcome.err, "");
}

TEST(Query, RaysAndViewsHaveTheCoordinatesOfTheFile) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("box.obj", utm_box());
    const Outcome hit = run({"trace", scene, "--rays", "-", "--out", "-"},
                            {.input = "528970.85 183528.1 12.5 1 0 0\n"});
    ASSERT_TRUE(hit.out.starts_with("H ")) << hit.out << hit.err;
    EXPECT_NEAR(std::stod(hit.out.substr(2)), 10, 1e-5) << hit.out;
    const Outcome probe =
        run({"probe", scene, "--frame", "0", "--pixel", "8,8", "--size", "16x16", "--eye",
             "528970.85,183528.6,12.5", "--target", "528990.85,183528.6,12.5"});
    EXPECT_TRUE(has(probe.out, "10 away")) << probe.err;
    EXPECT_TRUE(has(probe.out, "(528970.85"));
    const Outcome info = run({"info", scene});
    EXPECT_TRUE(has(info.out, "(528980.85"));
    EXPECT_TRUE(has(info.out, "origin"));
}

}  // namespace
}  // namespace mray::test
