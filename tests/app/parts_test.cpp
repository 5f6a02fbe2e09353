// Functions of the program, called directly.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include <glm/vector_relational.hpp>

#include "app/animation/animation_scene.h"
#include "app/animation/frames.h"
#include "app/base/messages.h"
#include "app/cli/command_line.h"
#include "app/commands/commands.h"
#include "app/commands/cross_checker.h"
#include "common/base/errors.h"
#include "common/scene/camera_setup.h"
#include "scenes/animation.h"
#include "tests/app/crosscheck/planted_checks.h"
#include "tests/support/temporary_folder.h"

namespace mray::app {
namespace {

TEST(Compare, LastBitOfAHitIsFound) {
    const Frame expected = test::numbered_frame(4, 4);
    Frame doctored = expected;
    doctored.hits[7].t = std::nextafter(doctored.hits[7].t, 2.0f);
    const CrosscheckOptions options = test::options_of("scene.obj", 4);
    Json scene = empty_report(options)["scenes"][0];
    scene["frames"].push_back(0.0);
    add_images(scene, options, {{"cpu"}, 0, morphray::Rays::ao, "brute"}, expected, doctored);
    const Json& row = scene["rows"][0];
    EXPECT_EQ(scene["equal"], false);
    EXPECT_EQ(row["equal"], false);
    EXPECT_EQ(row["differences"]["total"], 1);
    EXPECT_EQ(row["differences"]["t"], 1);
    EXPECT_TRUE(row["details"].get<std::string>().starts_with("  pixel 3,1\n")) << row;
    EXPECT_NE(row["hits_hash"], row["expected_hits_hash"]);
    EXPECT_EQ(row["image_hash"], row["expected_image_hash"]);
}

TEST(CrosscheckText, GivesTheCommandsThatTraceADifferingPixel) {
    CrosscheckOptions options = test::options_of("my scene.obj", 4);
    options.view.eye = morphray::Point{-1, 2, 3};
    const Frame expected = test::numbered_frame(4, 4);
    Frame doctored = expected;
    doctored.hits[7].t = 2;
    Json report = empty_report(options);
    Json& scene = report["scenes"][0];
    scene["frames"].push_back(3.0);
    add_images(scene, options, {{"vulkan", "", "refit", "cpu"}, 6.5, morphray::Rays::ao, "brute"},
               expected, doctored);
    const std::string text = run_text(report);
    EXPECT_NE(text.find("frame 6.5, vulkan, refit on cpu, ao: 1 pixel"), std::string::npos) << text;
    EXPECT_NE(text.find("brute    t 0x1.8p+0 u 0x1p-2 v 0x1p-1 prim 7"), std::string::npos) << text;
    EXPECT_NE(text.find("vulkan   t 0x1p+1 u 0x1p-2 v 0x1p-1 prim 7"), std::string::npos) << text;
    const std::string common =
        "    morphray probe 'my scene.obj' --frame 6.5 --pixel 3,1 --rays ao --size 4x4 --eye "
        "-1,2,3 --ao-samples 16 --backend ";
    EXPECT_NE(text.find(common + "brute --update rebuild\n"), std::string::npos) << text;
    EXPECT_NE(text.find(common + "vulkan --update refit --build-at 3\n"), std::string::npos)
        << text;
    // The program accepts these commands.
    const std::vector<std::string> arguments = {
        "probe",     "my scene.obj", "--frame",  "6.5",   "--pixel",    "3,1",
        "--size",    "4x4",          "--rays",   "ao",    "--eye",      "-1,2,3",
        "--backend", "vulkan",       "--update", "refit", "--build-at", "3"};
    const auto parsed = std::get<ProbeOptions>(parse_command_line(arguments).options.value());
    EXPECT_EQ(parsed.frame, 6.5);
    EXPECT_EQ(parsed.tree.build_at, 3);
    EXPECT_EQ(parsed.view.eye, options.view.eye);
}

TEST(Junit, DifferencesAreFailures) {
    Json report = test::planted_run(1, 0, 16, "a<b");
    add_trees(report["scenes"][0], 2, 5, 6);
    conclude(report, "");
    EXPECT_EQ(report["verdict"],
              "different: 4 of 8, first in a<b, frame 0, vulkan, refit on cpu, primary");
    conclude(report, "later could not be read");
    EXPECT_TRUE(report["verdict"].get<std::string>().ends_with(
        ", primary; not finished: later could not be read"));
    const std::string xml = to_junit(report);
    EXPECT_NE(xml.find("tests=\"8\" failures=\"4\""), std::string::npos) << xml;
    EXPECT_NE(xml.find("<failure message=\"5 pixels differ: "), std::string::npos) << xml;
    EXPECT_NE(xml.find("a&lt;b.vulkan, refit on cpu"), std::string::npos) << xml;
}

TEST(Junit, RunThatEndedEarlyHasAnError) {
    Json report = test::planted_run(1, 1, 16, "a<b");
    Json& scene = report["scenes"][0];
    scene["complete"] = false;
    scene["error"] = "Vulkan: the device was lost";
    report["error"] = scene["error"];
    const Json later = empty_report(test::options_of("later", 4))["scenes"][0];
    report["scenes"].push_back(later);
    const std::string xml = to_junit(report);
    EXPECT_NE(xml.find("tests=\"8\" failures=\"0\" errors=\"1\""), std::string::npos) << xml;
    EXPECT_NE(xml.find("tests=\"1\" failures=\"0\" errors=\"1\""), std::string::npos) << xml;
    EXPECT_NE(xml.find("<error message=\"Vulkan: the device was lost\">"), std::string::npos);
}

TEST(Failure, HasTheExitCodeOfItsKind) {
    const auto code_of = [](const auto& failure) {
        return describe_failure(std::make_exception_ptr(failure)).code;
    };
    EXPECT_EQ(code_of(Error(ErrorKind::kBadArgument, "usage")), ExitCode::kUsage);
    EXPECT_EQ(code_of(Error(ErrorKind::kDeviceLost, "lost")), ExitCode::kDeviceLost);
    EXPECT_EQ(code_of(Error(ErrorKind::kCancelled, "stop")), ExitCode::kInterrupted);
    EXPECT_EQ(code_of(std::bad_alloc()), ExitCode::kLimit);
    EXPECT_EQ(code_of(std::length_error("vector")), ExitCode::kLimit);
    EXPECT_EQ(code_of(std::system_error(EIO, std::generic_category())), ExitCode::kInternal);
    EXPECT_EQ(code_of(std::logic_error("bug")), ExitCode::kInternal);
    EXPECT_EQ(code_of(42), ExitCode::kInternal);
}

TEST(BruteForce, IsTheReferenceUpToTwoBillionTests) {
    morphray::View view;
    view.width = view.height = 1000;
    view.ao_count = 9;
    EXPECT_TRUE(brute_is_affordable(2000, view, morphray::Rays::primary));
    EXPECT_FALSE(brute_is_affordable(2001, view, morphray::Rays::primary));
    EXPECT_TRUE(brute_is_affordable(1000, view, morphray::Rays::shadow));
    EXPECT_FALSE(brute_is_affordable(1001, view, morphray::Rays::shadow));
    EXPECT_TRUE(brute_is_affordable(200, view, morphray::Rays::ao));
    EXPECT_FALSE(brute_is_affordable(201, view, morphray::Rays::ao));
}

TEST(WorldView, IsInsideClosedScenesUnlessAViewIsGiven) {
    const std::unique_ptr<Animation> animation = open_scene("builtin:hall:2000");
    const WorldBounds bounds = animation->bounds();
    const auto is_inside = [&](const morphray::Point& point) {
        const glm::dvec3 p = to_dvec3(point);
        return glm::all(glm::greaterThan(p, bounds.lower)) &&
               glm::all(glm::lessThan(p, bounds.upper));
    };
    const morphray::View view = world_view({}, *animation);
    EXPECT_TRUE(is_inside(*view.eye) && is_inside(*view.target) && is_inside(*view.light));
    const morphray::Point eye = {1, 200, 3};
    const morphray::View given = world_view({.eye = eye}, *animation);
    EXPECT_EQ(given.eye, eye);
    EXPECT_NE(given.target, view.target);
    EXPECT_EQ(given.light, view.light);
}

TEST(WorldView, FramesTheFirstFrameOfFilesFromTheirOrigin) {
    test::TemporaryFolder folder;
    folder.write("a_0.obj", "v 1e6 0 0\nv 1000001 0 0\nv 1e6 1 0\nf 1 2 3\n");
    folder.write("a_1.obj", "v 1000005 0 0\nv 1000006 0 0\nv 1000005 9 0\nf 1 2 3\n");
    const std::unique_ptr<Animation> animation = open_scene(folder.path());
    const glm::dvec3 origin = animation->origin().at;
    const vec3 first[] = {vec3(glm::dvec3(1e6, 0, 0) - origin),
                          vec3(glm::dvec3(1000001, 0, 0) - origin),
                          vec3(glm::dvec3(1e6, 1, 0) - origin)};
    const ViewSpec framed = frame_object({}, first);
    const morphray::View view = world_view({}, *animation);
    EXPECT_EQ(view.eye, framed.eye);
    EXPECT_EQ(view.target, framed.target);
    EXPECT_EQ(view.light, framed.light);
    const morphray::View given = world_view({.target = morphray::Point{1e6 + 1, 2, 3}}, *animation);
    EXPECT_EQ(given.target, to_point(glm::dvec3(1e6 + 1, 2, 3) - origin));
}

TEST(FrameLabel, SortsLikeItsNumber) {
    test::TemporaryFolder folder;
    for (const char* const number : {"9998", "9999", "10000", "10001"})
        folder.write(fmt::format("f_{}.obj", number), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::unique_ptr<Animation> animation = open_scene(folder.file("f_%d.obj"));
    const std::vector<double> frames = {9998, 9998.25, 9998.5, 9999, 9999.75, 10000, 10000.5};
    const FrameDigits digits = digits_of(frames, *animation);
    EXPECT_EQ(digits.whole, 5u);
    EXPECT_EQ(digits.fraction, 2u);
    std::vector<std::string> names;
    for (const double frame : frames)
        names.push_back(fmt::format("frame_{}.png", frame_label(frame, digits)));
    EXPECT_TRUE(std::is_sorted(names.begin(), names.end())) << names.front();
}

TEST(ProbeSentence, SaysWhatIsHitAndWhetherAllAgree) {
    const Hit hit = {4.0f, 0.25f, 0.5f, 46629};
    const Hit other = {4.0f, 0.25f, 0.5f, 7};
    EXPECT_EQ(probe_sentence(no_hit(), no_hit(), no_hit(), 0), "nothing; all agree");
    EXPECT_EQ(probe_sentence(hit, hit, hit, 10), "triangle 46629, 10 away; all agree");
    EXPECT_EQ(probe_sentence(hit, no_hit(), other, 10),
              "DIFFERENT: the image has triangle 46629 at t 0x1p+2, the ray alone nothing, brute "
              "force triangle 7 at t 0x1p+2");
}

}  // namespace
}  // namespace mray::app
