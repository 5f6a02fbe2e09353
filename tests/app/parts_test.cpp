// Functions of the program, called directly.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "app/base/values.h"
#include "app/cli/command_line.h"
#include "app/clip/frames.h"
#include "app/commands/crosscheck/cross_checker.h"
#include "app/commands/pixel_probe.h"
#include "app/terminal/failure.h"
#include "common/base/errors.h"
#include "scenes/clip.h"
#include "tests/app/scenes.h"
#include "tests/support/temporary_folder.h"

namespace mray::app {
namespace {

Frame frame_of(std::uint32_t width, std::uint32_t height) {
    Frame frame{width, height, {}, {}, {}};
    for (std::uint32_t i = 0; i < width * height; ++i) {
        frame.hits.push_back(i % 3 == 0 ? no_hit() : Hit{1.5f, 0.25f, 0.5f, i});
        frame.occlusion.push_back(i % 3 == 0 ? 0 : i % 5);
        frame.pixels.push_back(0xFF000000u + i);
    }
    return frame;
}

CheckRow compared(const Frame& actual) {
    CheckRow row;
    compare(frame_of(4, 4), actual, row);
    return row;
}

TEST(Compare, LastBitOfAHitIsFound) {
    Frame doctored = frame_of(4, 4);
    doctored.hits[7].t = std::nextafter(doctored.hits[7].t, 2.0f);
    const CheckRow row = compared(doctored);
    EXPECT_FALSE(row.equal());
    EXPECT_EQ(row.difference.total(), 1u);
    EXPECT_EQ(row.difference.t, 1u);
    ASSERT_EQ(row.difference.first.size(), 1u);
    EXPECT_EQ(row.difference.first[0].x, 3u);
    EXPECT_EQ(row.difference.first[0].y, 1u);
    EXPECT_NE(row.hits_hash, row.expected_hits_hash);
    EXPECT_EQ(row.image_hash, row.expected_image_hash);
}

CheckRun run_of(const CheckReport& report) {
    CheckRun run;
    run.environment.simd = {"avx2", "scalar"};
    run.scenes = {report};
    return run;
}

CheckReport planted_report() {
    CheckReport report;
    report.head.scene = "a<b";
    CheckRow row = compared(frame_of(4, 4));
    row.backend = "vulkan";
    row.update = "refit";
    row.refit_on = "cpu";
    row.rays = "ao";
    row.reference = "brute";
    report.rows.push_back(row);
    return report;
}

TEST(CrosscheckText, GivesTheCommandsThatTraceADifferingPixel) {
    CrosscheckOptions options;
    options.source.scene = "my scene.obj";
    options.view.width = options.view.height = 4;
    options.view.eye = Point{-1, 2, 3};
    Frame doctored = frame_of(4, 4);
    doctored.hits[7].t = 2;
    CheckRow row = planted_report().rows[0];
    compare(frame_of(4, 4), doctored, row);
    row.frame = 6.5;
    const std::string text = describe_row(options, row, 3);
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
    CheckReport report = planted_report();
    report.rows[0].difference.uv = 3;
    report.trees.push_back({2, 5, 6});
    const std::string xml = to_junit(run_of(report));
    EXPECT_NE(xml.find("tests=\"2\" failures=\"2\""), std::string::npos) << xml;
    EXPECT_NE(xml.find("<failure message=\"3 pixels differ: 3 "), std::string::npos) << xml;
    EXPECT_NE(xml.find("a&lt;b.vulkan, refit on cpu"), std::string::npos) << xml;
}

TEST(Junit, RunThatEndedEarlyHasAnError) {
    CheckReport report = planted_report();
    report.complete = false;
    report.error = "Vulkan: the device was lost";
    CheckRun run = run_of(report);
    run.error = report.error;
    CheckReport later = planted_report();
    later.rows.clear();
    later.complete = false;
    run.scenes.push_back(later);
    const std::string xml = to_junit(run);
    EXPECT_NE(xml.find("tests=\"2\" failures=\"0\" errors=\"1\""), std::string::npos) << xml;
    EXPECT_NE(xml.find("tests=\"1\" failures=\"0\" errors=\"1\""), std::string::npos) << xml;
    EXPECT_NE(xml.find("<error message=\"Vulkan: the device was lost\"/>"), std::string::npos);
    EXPECT_NE(xml.find("<testsuites>"), std::string::npos);
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
    ViewSpec view;
    view.width = view.height = 1000;
    view.ao_count = 9;
    EXPECT_TRUE(brute_is_affordable(2000, view, kRaysPrimary));
    EXPECT_FALSE(brute_is_affordable(2001, view, kRaysPrimary));
    EXPECT_TRUE(brute_is_affordable(1000, view, kRaysShadow));
    EXPECT_FALSE(brute_is_affordable(1001, view, kRaysShadow));
    EXPECT_TRUE(brute_is_affordable(200, view, kRaysAo));
    EXPECT_FALSE(brute_is_affordable(201, view, kRaysAo));
}

TEST(FrameLabel, SortsLikeItsNumber) {
    test::TemporaryFolder folder;
    for (const char* const number : {"9998", "9999", "10000", "10001"})
        folder.write(fmt::format("f_{}.obj", number), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::unique_ptr<Clip> clip = open_scene(folder.file("f_%d.obj"));
    const std::vector<double> frames = {9998, 9998.25, 9998.5, 9999, 9999.75, 10000, 10000.5};
    const FrameDigits digits = digits_of(frames, *clip);
    EXPECT_EQ(digits.whole, 5u);
    EXPECT_EQ(digits.fraction, 2u);
    std::vector<std::string> names;
    for (const double frame : frames)
        names.push_back(fmt::format("frame_{}.png", frame_label(frame, digits)));
    EXPECT_TRUE(std::is_sorted(names.begin(), names.end())) << names.front();
}

ProbeReport probe(const std::string& scene, std::vector<std::string> more) {
    std::vector<std::string> all = {"probe", scene,   "--frame", "0",        "--size",
                                    "32x32", "--eye", "0,0,5",   "--target", "0,0,0"};
    all.insert(all.end(), more.begin(), more.end());
    return probe_pixel(std::get<ProbeOptions>(parse_command_line(all).options.value()), Messages());
}

TEST(Probe, GivesTheSameResultOnEveryBackend) {
    const test::TemporaryFolder folder;
    const std::string scene = folder.write("s.obj", test::square_at(0));
    for (const char* backend : {"cpu", "brute"}) {
        const ProbeReport report =
            probe(scene, {"--pixel", "16,16", "--backend", backend, "--rays", "ao"});
        EXPECT_EQ(report.image.prim_id, report.alone.prim_id);
        EXPECT_EQ(report.image.t, report.alone.t);
        EXPECT_NEAR(report.image.t * report.world_depth, 5, 1e-5);
        EXPECT_EQ(report.secondary.size(), 16u);
        EXPECT_EQ(report.occlusion, 0u);
        const Candidate& first = report.candidates.at(0);
        EXPECT_EQ(first.prim_id, report.image.prim_id);
        EXPECT_EQ(first.t, report.image.t);
        EXPECT_EQ(first.u, report.image.u);
        EXPECT_EQ(first.v, report.image.v);
        EXPECT_TRUE(first.is_hit && first.may_hit && first.inside && first.has_area);
        EXPECT_TRUE(first.in_range && first.finite && first.meets_box);
    }
    const ProbeReport miss = probe(scene, {"--pixel", "0,0", "--backend", "cpu"});
    EXPECT_EQ(miss.image.prim_id, kNoPrim);
    EXPECT_TRUE(miss.candidates.empty());
}

TEST(ProbeSentence, SaysWhatIsHitAndWhetherAllAgree) {
    ProbeReport report;
    EXPECT_EQ(probe_sentence(report), "nothing; all agree");
    report.exponent = 1;
    report.ray.dir = vec3(0, 3, 4);
    report.image = {4.0f, 0.25f, 0.5f, 46629};
    report.alone = report.image;
    Candidate candidate;
    candidate.prim_id = 46629;
    candidate.t = 4;
    candidate.u = 0.25f;
    candidate.v = 0.5f;
    candidate.is_hit = true;
    report.candidates.push_back(candidate);
    EXPECT_EQ(probe_sentence(report), "triangle 46629, 10 away; all agree");
    report.alone = no_hit();
    report.candidates[0].prim_id = 7;
    EXPECT_EQ(probe_sentence(report),
              "DIFFERENT: the image has triangle 46629 at t 0x1p+2, the ray alone nothing, brute "
              "force triangle 7 at t 0x1p+2");
}

}  // namespace
}  // namespace mray::app
