// Reports of cross-checks with planted differences, the page among them, and the batch of
// --queries.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "app/cli/command_line.h"
#include "app/commands/crosscheck.h"
#include "app/report/check_report.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/pose.h"
#include "cpu/cpu_backend.h"
#include "tests/support/text.h"

namespace mray::app {
namespace {

using namespace test;

/// An image of hits, every third pixel a miss, in noise.
Frame numbered_frame(std::uint32_t width, std::uint32_t height) {
    Frame frame{width, height, {}, {}, {}};
    std::mt19937 random(1);
    for (std::uint32_t i = 0; i < width * height; ++i) {
        frame.hits.push_back(i % 3 == 0 ? no_hit() : Hit{1.5f, 0.25f, 0.5f, i});
        frame.occlusion.push_back(i % 3 == 0 ? 0 : i % 5);
        frame.pixels.push_back(0xFF000000u | static_cast<std::uint32_t>(random()));
    }
    return frame;
}

/// The options of a check of one scene.
Options options_of(const std::string& spec, std::uint32_t side) {
    Options options;
    options.inputs = {spec};
    options.source.scene = spec;
    options.view.width = options.view.height = side;
    options.arguments = {"crosscheck", "x"};
    return options;
}

/// One scene of `frames` frames on two backends, three kinds of rays each. Of Vulkan's images of
/// frames from `first_wrong` on, some pixels differ.
Json planted_run(int frames, int first_wrong, std::uint32_t side,
                 const std::string& spec = "a&b <\"'scene'> </script>.obj") {
    const Frame expected = numbered_frame(side, side);
    Frame wrong = expected;
    wrong.hits[side + 1].t = std::nextafter(wrong.hits[side + 1].t, 2.0f);
    wrong.hits[2 * side + 2] = no_hit();
    wrong.hits[3 * side] = Hit{2, 0, 0, 7};
    wrong.hits[3 * side + 5].prim_id += 3;
    wrong.pixels[4 * side + 4] ^= 0x10;
    const Options options = options_of(spec, side);
    Json run = empty_report(options);
    run["environment"]["simd"] = {"avx2", "scalar"};
    Json& scene = run["scenes"][0];
    for (int frame = 0; frame < frames; ++frame) {
        const double number = frame;
        scene["frames"].push_back(number);
        for (const char* backend : {"vulkan", "cpu"}) {
            for (const auto rays :
                 {morphray::Rays::primary, morphray::Rays::shadow, morphray::Rays::ao}) {
                const bool differs = *backend == 'v' && frame >= first_wrong;
                add_images(scene, options, {backend, "", "cpu", number, rays, "brute"}, expected,
                           differs ? wrong : expected);
            }
        }
        add_trees(scene, number, 5, 5);
    }
    scene["complete"] = true;
    conclude(run, "");
    return run;
}

std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
        ++found;
    return found;
}

Json embedded(const std::string& page) {
    const std::string begin = "<script type=\"application/json\" id=\"report\">";
    const std::size_t from = page.find(begin) + begin.size();
    return Json::parse(page.substr(from, page.find("</script>", from) - from));
}

TEST(CrosscheckPage, HasTheJsonOfTheReportAndEscapesWhatComesFromOutside) {
    const Json run = planted_run(2, 1, 16);
    const std::string page = to_html(run);
    // The page itself has one, for the data.
    EXPECT_EQ(count(page, "</script>"), 1u);
    EXPECT_TRUE(has(page, "<h2>a&amp;b &lt;&quot;'scene'&gt; &lt;/script&gt;.obj</h2>"));
    EXPECT_EQ(embedded(page), Json::parse(json_text(run)));
    EXPECT_EQ(embedded(page)["scenes"][0]["scene"], run["scenes"][0]["spec"]);
}

TEST(CrosscheckPage, HasVerdictTableAndThePixelsAndCommandsOfEachImageThatDiffers) {
    const Json run = planted_run(3, 1, 16, "builtin:one");
    const std::string page = to_html(run);
    EXPECT_TRUE(has(page, "<p class=\"different\"><strong>different: 6 of 21, first in "));
    EXPECT_TRUE(has(page, "vulkan, refit on cpu               9  6 differ"));
    EXPECT_TRUE(has(page, "cpu, refit on cpu                  9  equal"));
    EXPECT_EQ(count(page, "frame 1, vulkan, refit on cpu, shadow: 5 pixels"), 1u);
    const Json rows = embedded(page)["scenes"][0]["rows"];
    std::size_t described = 0;
    for (const Json& row : rows) described += row.contains("details");
    EXPECT_EQ(described, 6u);
    EXPECT_TRUE(rows[6]["message"].get<std::string>().starts_with("5 pixels")) << rows[6];
    const std::string text = rows[6]["details"];
    EXPECT_TRUE(has(text, "0x1.800002p+0"));
    const std::string command = "morphray probe builtin:one --frame 1 --pixel 1,1 ";
    EXPECT_TRUE(has(text, command));
    EXPECT_TRUE(has(page, "\n    " + command));
    EXPECT_TRUE(has(to_junit(run), command));
}

TEST(CrosscheckPage, DescribesAHundredImages) {
    const Json rows = embedded(to_html(planted_run(84, 0, 16)))["scenes"][0]["rows"];
    EXPECT_EQ(rows.size(), 504u);
    std::size_t described = 0;
    for (const Json& row : rows) described += row.contains("details");
    EXPECT_EQ(described, 100u);
}

TEST(CrosscheckPage, LoadsNothing) {
    const std::string page = to_html(planted_run(2, 0, 16));
    for (const char* part :
         {"http://", "https://", "@import", "url(", "<link", "<iframe", "src=\""})
        EXPECT_FALSE(has(page, part)) << part;
}

struct Answered {
    Topology topology;
    std::vector<vec3> positions;
    CheckBatch batch;
    Answers answers;
};

/// A tetrahedron, and its answers.
Answered query_tetrahedron(std::uint32_t count) {
    Answered one;
    one.topology.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    one.topology.vertex_count = 4;
    one.positions = {{0, 0, 0}, {1024, 0, 0}, {0, 1024, 0}, {0, 0, 1024}};
    one.batch = pseudo_random_batch(one.topology, one.positions, count);
    const auto backend = cpu::make_cpu_backend({});
    const Pose pose(one.positions);
    backend->set_scene(one.topology, pose, build_bvh(one.topology, one.positions));
    one.answers = answers_of(*backend, one.batch);
    return one;
}

TEST(QueryCheck, BatchesAreTheSameAndHitTheMesh) {
    const Answered a = query_tetrahedron(200);
    const Answered b = query_tetrahedron(200);
    ASSERT_EQ(a.batch.rays.size(), 200u);
    ASSERT_EQ(a.batch.points.size(), 200u);
    for (const QueryDifference& kind : compare_answers(a.answers, b.answers))
        EXPECT_EQ(kind.count, 0u) << kind.name;
    EXPECT_GT(a.answers.hits[1].hits.size(), 100u);
    std::size_t inside = 0;
    for (const FloatWinding& winding : a.answers.windings) inside += winding.winding != 0;
    EXPECT_GT(inside, 0u);
    EXPECT_LT(inside, 200u);
    for (const ClosestTriangle& closest : a.answers.closest) EXPECT_NE(closest.prim_id, kNoPrim);
}

TEST(QueryCheck, EmptyMeshHasABatchToo) {
    const CheckBatch batch = pseudo_random_batch({}, {}, 5);
    EXPECT_EQ(batch.rays.size(), 5u);
    EXPECT_EQ(batch.points.size(), 5u);
}

TEST(QueryCheck, EveryBitOfAnAnswerCounts) {
    const Answered one = query_tetrahedron(50);
    const auto compare_with = [&](const auto& change) {
        Answers other = one.answers;
        change(other);
        std::vector<std::size_t> counts;
        for (const QueryDifference& kind : compare_answers(one.answers, other))
            counts.push_back(kind.count);
        return counts;
    };
    using Counts = std::vector<std::size_t>;
    const auto last_bit = compare_with([](Answers& other) {
        float& t = other.hits[0].hits.front().t;
        t = std::nextafter(t, 0.0f);
    });
    EXPECT_EQ(last_bit, (Counts{1, 0, 0}));
    EXPECT_EQ(compare_with([](Answers& other) { ++other.hits[1].total.back(); })[0], 1u);
    const auto windings = compare_with([](Answers& other) {
        ++other.windings[3].crossings;
        other.uncertain.push_back({7, 0xFFFFFF});
    });
    EXPECT_EQ(windings, (Counts{0, 2, 0}));
    const auto closest = compare_with([](Answers& other) {
        other.closest[4].d2 = std::nextafter(other.closest[4].d2, 1e30f);
        ++other.closest[5].prim_id;
    });
    EXPECT_EQ(closest, (Counts{0, 0, 2}));
}

TEST(QueryCheck, ReportsNameTheAnswersThatDiffer) {
    Json run = planted_run(1, 1, 8, "scene.obj");
    Json& scene = run["scenes"][0];
    EXPECT_EQ(scene["equal"], true);
    Options options = options_of("scene.obj", 8);
    options.query_count = 100;
    CheckedImage image{.backend = "cpu", .reference = "brute"};
    add_answers(scene, options, image, {});
    image.backend = "vulkan";
    add_answers(scene, options, image,
                {{"all_hits", "all hits", 3},
                 {"winding", "windings", 1},
                 {"closest", "closest triangles", 0}});
    EXPECT_EQ(scene["equal"], false);
    EXPECT_EQ(count_differing(scene["queries"]), 1u);
    const std::string text = run_text(run);
    EXPECT_TRUE(has(text,
                    "frame 0, vulkan, rebuild, queries: other answers: 3 in all hits, 1 in "
                    "windings, 0 in closest triangles\n"));
    EXPECT_EQ(scene["queries"][1]["differences"]["all_hits"], 3);
    EXPECT_TRUE(has(to_junit(run), "<failure message=\"other answers: 3 in"));
}

TEST(CrosscheckText, GivesTheCommandsThatTraceADifferingPixel) {
    Options options = options_of("my scene.obj", 4);
    options.view.eye = morphray::Point{-1, 2, 3};
    const Frame expected = numbered_frame(4, 4);
    Frame doctored = expected;
    doctored.hits[7].t = std::nextafter(1.5f, 2.0f);
    Json report = empty_report(options);
    Json& scene = report["scenes"][0];
    scene["frames"].push_back(3.0);
    add_images(scene, options, {"vulkan", "", "cpu", 6.5, morphray::Rays::ao, "brute"}, expected,
               doctored);
    EXPECT_EQ(scene["equal"], false);
    EXPECT_EQ(scene["rows"][0]["differences"]["total"], 1);
    EXPECT_NE(scene["rows"][0]["hits_hash"], scene["rows"][0]["expected_hits_hash"]);
    EXPECT_EQ(scene["rows"][0]["image_hash"], scene["rows"][0]["expected_image_hash"]);
    const std::string text = run_text(report);
    EXPECT_TRUE(has(text, "frame 6.5, vulkan, refit on cpu, ao: 1 pixel"));
    EXPECT_TRUE(has(text, "brute    t 0x1.8p+0 u 0x1p-2 v 0x1p-1 prim 7"));
    EXPECT_TRUE(has(text, "vulkan   t 0x1.800002p+0 u 0x1p-2 v 0x1p-1 prim 7"));
    const std::string common =
        "    morphray probe 'my scene.obj' --frame 6.5 --pixel 3,1 --rays ao --size 4x4 --eye "
        "-1,2,3 --ao-samples 16 --backend ";
    EXPECT_TRUE(has(text, common + "brute --update rebuild\n"));
    EXPECT_TRUE(has(text, common + "vulkan --update refit --build-at 3\n"));
    // The program accepts these commands.
    const std::vector<std::string> arguments = {
        "probe",     "my scene.obj", "--frame",  "6.5",   "--pixel",    "3,1",
        "--size",    "4x4",          "--rays",   "ao",    "--eye",      "-1,2,3",
        "--backend", "vulkan",       "--update", "refit", "--build-at", "3"};
    const Options parsed = parse_command_line(arguments).options.value();
    EXPECT_EQ(parsed.frame, 6.5);
    EXPECT_EQ(parsed.tree.build_at, 3);
    EXPECT_EQ(parsed.view.eye, options.view.eye);
}

TEST(Junit, DifferencesAreFailures) {
    Json report = planted_run(1, 0, 16, "a<&\"b");
    add_trees(report["scenes"][0], 2, 5, 6);
    conclude(report, "");
    EXPECT_EQ(report["verdict"],
              "different: 4 of 8, first in a<&\"b, frame 0, vulkan, refit on cpu, primary");
    conclude(report, "later could not be read");
    EXPECT_TRUE(report["verdict"].get<std::string>().ends_with(
        ", primary; not finished: later could not be read"));
    const std::string xml = to_junit(report);
    EXPECT_TRUE(has(xml, "tests=\"8\" failures=\"4\""));
    EXPECT_TRUE(has(xml, "<failure message=\"5 pixels differ: "));
    EXPECT_TRUE(has(xml, "a&lt;&amp;&quot;b.vulkan, refit on cpu"));
}

TEST(Junit, RunThatEndedEarlyHasAnError) {
    Json report = planted_run(1, 1, 16, "a<b");
    Json& scene = report["scenes"][0];
    scene["complete"] = false;
    scene["error"] = "Vulkan: the device was lost";
    report["error"] = scene["error"];
    const Json later = empty_report(options_of("later", 4))["scenes"][0];
    report["scenes"].push_back(later);
    const std::string xml = to_junit(report);
    EXPECT_TRUE(has(xml, "tests=\"8\" failures=\"0\" errors=\"1\""));
    EXPECT_TRUE(has(xml, "tests=\"1\" failures=\"0\" errors=\"1\""));
    EXPECT_TRUE(has(xml, "<error message=\"Vulkan: the device was lost\">"));
}

}  // namespace
}  // namespace mray::app
