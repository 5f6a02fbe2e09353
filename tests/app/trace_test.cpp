// Explicit rays against geometry whose answers are known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

/// The answers about rays through a scene of this OBJ text.
Outcome trace(const std::string& obj, const std::string& rays, const Words& more = {}) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", obj);
    return run(words("trace " + scene + " --rays - --out -", more), {.input = rays});
}

TEST(Trace, UnitTriangleIsHitAtItsKnownPointWithinTheInterval) {
    const std::string rays =
        "0.25 0.5 2 0 0 -1\n0.25 0.5 2 0 0 -4 0 inf\n0.25 0.25 2 0 0 -1 0 1.9\n"
        "0.25 0.25 2 0 0 -1 0 2.1\n0.25 0.25 2 0 0 -1 2.1 inf\n0.25 0.25 2 0 0 1\n";
    for (const char* backend : {"cpu", "brute"}) {
        const Outcome outcome = trace(unit_triangle(), rays, {"--backend", backend});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
        EXPECT_EQ(outcome.out, "H 2 0 0.25 0.5\nH 0.5 0 0.25 0.5\nM\nH 2 0 0.25 0.25\nM\nM\n");
    }
}

TEST(Trace, DistanceBeyondTheRangeOfFloatsIsPrinted) {
    const Outcome outcome = trace(unit_triangle(1e30), "2.5e29 2.5e29 1e30 0 0 -1e-20\n");
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NEAR(std::stod(outcome.out.substr(2)) / 1e50, 1, 1e-6) << outcome.out;
}

TEST(Trace, CommentsAndBlankLinesHaveNoAnswer) {
    const Outcome outcome = trace(unit_triangle(),
                                  "# rays\n\n   \t\n0.25\t0.25 2 0 0 -1 # down\r\n"
                                  "  #\n9 9 9 0 0 -1");
    EXPECT_EQ(outcome.out, "H 2 0 0.25 0.25\nM\n") << outcome.err;
}

TEST(Trace, InvalidRaysMissWithOneWarning) {
    const Outcome outcome = trace(unit_triangle(),
                                  "nan 0 2 0 0 -1\n0.25 0.25 2 0 0 0\n0.25 0.25 2 0 -inf 0\n"
                                  "0.25 0.25 2 0 0 -1 5 3\n0.25 0.25 2 0 0 -1\n0 0 1e39 0 0 -1\n");
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "M\nM\nM\nM\nH 2 0 0.25 0.25\nM\n");
    ASSERT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(has(outcome.err,
                    "5 of 6 rays (first: 0, counted from 0) hit nothing: not finite, without "
                    "direction or interval"));
}

TEST(Trace, RaysLeaveOutTheTriangleThatTheyName) {
    const std::string ray = "0.25 0.25 2 0 0 -1";
    const Outcome outcome = trace(unit_triangle(), ray + "\n" + ray + " 0 inf 0\n" + ray + "\n");
    EXPECT_EQ(outcome.out, "H 2 0 0.25 0.25\nM\nH 2 0 0.25 0.25\n") << outcome.err;
}

TEST(Trace, SyntaxErrorNamesFileAndLine) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle());
    const std::string out = folder.file("answers");
    for (const char* line : {"0 0 2 0 0", "0 0 2 0 0 -1 0", "0 0 2 0 0 x", "0,5 0 2 0 0 -1",
                             "1 2 3 4 5 6 7 8 9 1", "1 2 3 4 5 6 7 8 0.5", "0x1 0 2 0 0 -1"}) {
        const std::string rays = folder.write("rays", std::string("0 0 2 0 0 -1\n#\n") + line);
        const Outcome outcome = run({"trace", scene, "--rays", rays, "--out", out});
        EXPECT_EQ(outcome.code, 3) << line;
        EXPECT_TRUE(outcome.err.starts_with(rays + ":3: ")) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(out)) << line;
    }
    EXPECT_TRUE(trace(unit_triangle(), "1 2 3\n").err.starts_with("<stdin>:1: "));
}

TEST(Trace, BinaryRaysAnswerLikeText) {
    const float rays[2][8] = {{0.25f, 0.5f, 2, 0, 0, 0, -1, INFINITY}, {5, 5, 5, 0, 0, 0, 1, 1}};
    std::string bytes(sizeof(rays), '\0');
    std::memcpy(bytes.data(), rays, sizeof(rays));
    EXPECT_EQ(trace(unit_triangle(), bytes, {"--binary"}).out, "H 2 0 0.25 0.5\nM\n");
    const Outcome cut = trace(unit_triangle(), bytes.substr(0, 40), {"--binary"});
    EXPECT_EQ(cut.code, 3);
    EXPECT_TRUE(cut.err.starts_with("<stdin>: 40 bytes")) << cut.err;

    // What numpy.save() writes for ray_dtype and for float32 of shape (2, 8).
    const auto npy = [&bytes](const std::string& type, const std::string& shape,
                              const std::string& is_fortran = "False") {
        std::string form = "{'descr': " + type + ", 'fortran_order': " + is_fortran +
                           ", 'shape': (" + shape + "), }";
        form.resize(246, ' ');
        return std::string("\x93NUMPY\x01\x00\xf6\x00", 10) + form + bytes;
    };
    std::string without_shape = npy("'<f4'", "2, 8");
    without_shape.replace(without_shape.find("shape"), 5, "count");
    const std::string fields =
        "[('org', '<f4', (3,)), ('tnear', '<f4'), ('dir', '<f4', (3,)), ('tfar', '<f4')]";
    for (const std::string& array :
         {npy(fields, "2,"), npy("'<f4'", "2, 8"), npy("'<f4'", "1, 2, 8")})
        EXPECT_EQ(trace(unit_triangle(), array).out, "H 2 0 0.25 0.5\nM\n");
    // Doubles.
    const double six[] = {0.25, 0.25, 2, 0, 0, -1};
    bytes.assign(reinterpret_cast<const char*>(six), sizeof(six));
    EXPECT_EQ(trace(unit_triangle(), npy("'<f8'", "6,")).out, "H 2 0 0.25 0.25\n");
    for (const std::string& array :
         {npy(fields, "4,"), npy("'<f8'", "1, 8"), npy("'>f8'", "2, 6"),
          npy("'<f8'", "2, 6").substr(0, 60), npy("'<f8'", "6,", "True"), without_shape}) {
        const Outcome refused = trace(unit_triangle(), array);
        EXPECT_EQ(refused.code, 3) << refused.err;
        EXPECT_TRUE(refused.err.starts_with("<stdin>: the .npy file")) << refused.err;
    }
}

TEST(Trace, NoTriangleThatDoesNotExistIsLeftOut) {
    const std::string rays = "0.25 0.25 2 0 0 -1\n0.25 0.25 2 0 0 -1 0 inf 1\n";
    const Outcome refused = trace(unit_triangle(), rays);
    EXPECT_EQ(refused.code, 3);
    EXPECT_TRUE(has(refused.err, "ray 1, counted from 0, leaves out triangle 1, but there are 1"));
}

TEST(Trace, WarnsOfTrianglesThatAreTooSmall) {
    const Outcome outcome = trace(
        "v 0 0 0\nv 8.67e-19 0 0\nv 0 8.67e-19 0\nv 4 0 0\nv 5 0 0\nv 4 1 0\nf 4 5 6\nf 1 2 3\n",
        "4.25 0.25 1 0 0 -1\n");
    EXPECT_EQ(outcome.out, "H 1 0 0.25 0.25\n");
    EXPECT_TRUE(has(outcome.err, "1 of 2 triangles are never hit")) << outcome.err;
}

TEST(Trace, FloatsPrintedWithNineDigitsComeBackAsThemselves) {
    // 148376.5625 is a float, and prints as 148376.562.
    const Outcome outcome =
        trace("v 148376 0 0\nv 148380 0 0\nv 148376 4 0\nf 1 2 3\n", "148376.562 1 2 0 0 -1\n");
    EXPECT_EQ(outcome.out, "H 2 0 0.140625 0.25\n") << outcome.err;
}

TEST(Trace, TrianglesThatAreNotFiniteAreWarnedAboutAndNeverHit) {
    const Outcome outcome =
        trace(unit_triangle() + "v nan 0 1\nv 1 0 1\nv 0 1 1\nf 4 5 6\nf 1 2 4\n",
              "0.25 0.25 2 0 0 -1\n", {"--lenient"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "H 2 0 0.25 0.25\n");
    EXPECT_TRUE(has(outcome.err, "2 of 3 triangles are not finite"));
}

TEST(Trace, AllHitsOfARayFollowItsCount) {
    const std::string rays = "0.5 0.25 3 0 0 -1\n9 9 9 0 0 -1\n0.5 0.25 3 0 0 -4\n";
    for (const char* backend : {"cpu", "brute"}) {
        const Outcome outcome =
            trace(square_at(0) + square_at(0, -2), rays, {"--all", "--backend", backend});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
        EXPECT_EQ(outcome.out,
                  "R 2 0\nH 3 0 0.125 0.625\nH 5 2 0.125 0.625\nR 0 0\n"
                  "R 2 0\nH 0.75 0 0.125 0.625\nH 1.25 2 0.125 0.625\n");
    }
}

TEST(Trace, HitsBeyondTheMostAreCountedAndWarnedAbout) {
    const Outcome outcome = trace(square_at(0) + square_at(0, -2),
                                  "0.5 0.25 3 0 0 -1\n9 9 9 0 0 -1\n0.5 0.25 -1 0 0 -1\n",
                                  {"--all", "--max-hits", "1"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "R 1 1\nH 3 0 0.125 0.625\nR 0 0\nR 1 0\nH 1 2 0.125 0.625\n");
    ASSERT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(
        has(outcome.err, "1 of 3 rays have more hits than --max-hits 1; 1 hits are left out"));
}

TEST(Trace, EdgeBelongsToOneTriangleUnlessEachIsAsked) {
    const auto hits = [&](Words more) {
        more.insert(more.begin(), "--all");
        return lines(trace(square_at(0), "0 0 1 0 0 -1\n", more).out).at(0);
    };
    EXPECT_EQ(hits({}), "R 1 0");
    EXPECT_EQ(hits({"--crossing", "owner"}), "R 1 0");
    EXPECT_EQ(hits({"--crossing", "each"}), "R 2 0");
}

TEST(Trace, PipesAndDevicesAreNotReadAsRays) {
    const Outcome outcome =
        run({"trace", "builtin:cloth:500", "--rays", "/dev/zero", "--out", "-"});
    EXPECT_EQ(outcome.code, 3);
    EXPECT_TRUE(outcome.err.starts_with("/dev/zero: ")) << outcome.err;
}

}  // namespace
}  // namespace mray::test
