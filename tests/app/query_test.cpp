// Points against geometry whose answers are known.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/app/npy_data.h"
#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Outcome query(const std::string& scene, const std::string& points, Words more) {
    Words all = {"query", scene, "--points", "-"};
    all.insert(all.end(), more.begin(), more.end());
    return run(all, {.input = points});
}

/// A file of numpy with this header.
std::string npy(const std::string& header, const std::string& data, char version = 1) {
    std::string file = "\x93NUMPY";
    file += version;
    file += '\0';
    file += static_cast<char>(header.size());
    file.append(version == 1 ? 1 : 3, '\0');
    return file + header + data;
}

template <class Number>
std::string bytes_of(std::initializer_list<Number> numbers) {
    return {reinterpret_cast<const char*>(numbers.begin()), numbers.size() * sizeof(Number)};
}

std::string header_of(const std::string& type, const std::string& shape,
                      const std::string& order = "False") {
    return fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}\n", type, order,
                       shape);
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

TEST(Query, JsonHasTheSameAnswers) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle());
    const Outcome outcome = query(scene, "0.25 0.5 2\nnan 0 0\n",
                                  {"--ask", "inside,winding,distance,closest", "--format", "json"});
    EXPECT_EQ(outcome.code, 0);
    ASSERT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find("<stdin>: warning: 1 of 2 points are not finite"), std::string::npos)
        << outcome.err;
    const Json json = Json::parse(outcome.out);
    EXPECT_EQ(json["command"], "query");
    EXPECT_EQ(json["scene"], scene);
    EXPECT_EQ(json["frame"], 0);
    EXPECT_EQ(json["rule"], "nonzero");
    EXPECT_EQ(json["points"], Json::parse(R"([
        {"point": [0.25, 0.5, 2], "inside": false, "winding": 0, "distance": 2,
         "closest": {"point": [0.25, 0.5, 0], "distance": 2, "prim_id": 0, "u": 0.25, "v": 0.5,
                     "feature": "face"}},
        {"point": [null, 0, 0], "inside": false, "winding": 0, "distance": null,
         "closest": null}])"));
}

TEST(Query, NumpyFileHasARecordForEachPoint) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle());
    const std::string out = folder.file("answers.npy");
    const Outcome outcome =
        query(scene, "0.25 0.5 2\n-3 -4 0\n",
              {"--ask", "inside,closest,winding", "--format", "npy", "--out", out});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const std::string data = npy_data(
        read_file(out),
        "{'descr': [('inside', '|b1'), ('closest_point', '<f4', (3,)), ('closest_distance', "
        "'<f4'), "
        "('prim_id', '<u4'), ('u', '<f4'), ('v', '<f4'), ('feature', '|u1'), ('winding', '<i4')], "
        "'fortran_order': False, 'shape': (2,), }");
    ASSERT_EQ(data.size(), 2u * 34);
    EXPECT_EQ(value_at<float>(data, 1), 0.25f);
    EXPECT_EQ(value_at<float>(data, 13), 2);
    EXPECT_EQ(value_at<float>(data, 34 + 13), 5);
    EXPECT_EQ(data[34 + 29], 2);  // a vertex
}

TEST(Query, ArraysOfNumpyAnswerLikeText) {
    TemporaryFolder folder;
    const std::string scene = folder.write("cube.obj", cube());
    const std::string expected = query(scene, "0.25 0.5 0.125\n3 0 0\n", {"--ask", "distance"}).out;
    const auto floats = bytes_of({0.25f, 0.5f, 0.125f, 3.0f, 0.0f, 0.0f});
    const auto doubles = bytes_of({0.25, 0.5, 0.125, 3.0, 0.0, 0.0});
    for (const std::string& file :
         {npy(header_of("<f4", "(2, 3)"), floats), npy(header_of("<f8", "(2, 3)"), doubles),
          npy(header_of("<f4", "(2, 3)"), floats, 2)}) {
        const Outcome outcome = query(scene, file, {"--ask", "distance"});
        EXPECT_EQ(outcome.out, expected) << outcome.err;
    }
    EXPECT_EQ(query(scene, npy(header_of("<f8", "(0, 3)"), ""), {"--ask", "distance"}).out, "");
}

TEST(Query, OtherArraysAreRefusedWithTheReason) {
    TemporaryFolder folder;
    const std::string scene = folder.write("cube.obj", cube());
    const std::string out = folder.file("answers");
    const std::string point = bytes_of({1.0f, 2.0f, 3.0f});
    struct Case {
        std::string file;
        std::string reason;
    };
    for (const Case& c :
         {Case{npy(header_of("<i4", "(1, 3)"), point), "the type '<i4'"},
          Case{npy(header_of(">f4", "(1, 3)"), point), "the type '>f4'"},
          Case{npy(header_of("<f4", "(3,)"), point), "the shape (3,)"},
          Case{npy(header_of("<f4", "(1, 4)"), point), "the shape (1, 4)"},
          Case{npy(header_of("<f4", "(x, 3)"), point), "the shape (x, 3)"},
          Case{npy(header_of("<f4", "(1, 3)", "True"), point), "the order of Fortran"},
          Case{npy(header_of("<f4", "(2, 3)"), point), "12 bytes are not 2 points of 12 bytes"},
          Case{npy(header_of("<f4", "(18446744073709551615, 3)"), point), "12 bytes are not"},
          Case{npy(header_of("<f4", "(1, 3)"), point + "x"), "13 bytes are not 1 points"},
          Case{npy(header_of("<f4", "(1, 3)"), point).substr(0, 30), "its header is cut off"},
          Case{npy("{}\n", point), "the type"}, Case{"\x93NUMPY\x02", "no whole array"}}) {
        const std::string points = folder.write("points.npy", c.file);
        const Outcome outcome =
            run({"query", scene, "--points", points, "--ask", "inside", "--out", out});
        EXPECT_EQ(outcome.code, 3) << c.reason;
        EXPECT_TRUE(outcome.err.starts_with(points + ": ")) << outcome.err;
        EXPECT_NE(outcome.err.find(c.reason), std::string::npos) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_FALSE(std::filesystem::exists(out));
    }
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

TEST(Query, FrameOfASequenceIsChosen) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", square_at(10));
    const std::string scene = folder.file("s");
    EXPECT_EQ(query(scene, "5 0 0\n", {"--ask", "distance"}).out, "4\n");
    EXPECT_EQ(query(scene, "5 0 0\n", {"--ask", "distance", "--frame", "0.5"}).out, "0\n");
    EXPECT_EQ(query(scene, "5 0 0\n", {"--ask", "inside", "--frame", "3"}).code, 2);
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

}  // namespace
}  // namespace mray::test
