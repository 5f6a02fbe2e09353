// Functions of the program, called directly.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include <glm/vector_relational.hpp>

#include "app/animation/animation_scene.h"
#include "app/animation/frames.h"
#include "app/base/messages.h"
#include "app/cli/command_line.h"
#include "app/commands/commands.h"
#include "app/commands/crosscheck.h"
#include "common/base/errors.h"
#include "common/scene/camera_setup.h"
#include "scenes/animation.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text.h"
#include "tests/support/thrown_error.h"

namespace mray::app {
namespace {

using namespace test;

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
    const std::vector<std::string> labels = frame_labels(frames, *animation);
    EXPECT_EQ(labels.front(), "09998.00");
    EXPECT_EQ(labels.back(), "10000.50");
    EXPECT_TRUE(std::is_sorted(labels.begin(), labels.end())) << labels.front();
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

/// The exit code of a child that runs `body`; the child exits with body's result.
int code_of_child(const std::function<int()>& body) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(body());
    int status = -1;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Interrupt, FirstSignalIsNotedAndTheSecondOneEndsTheProcess) {
    EXPECT_EQ(code_of_child([] {
                  handle_signals();
                  ::raise(SIGTERM);
                  return interrupted() ? 128 + interrupt_signal() : 1;
              }),
              143);
    EXPECT_EQ(code_of_child([] {
                  handle_signals();
                  ::raise(SIGTERM);
                  ::raise(SIGINT);
                  return 1;
              }),
              130);
}

TEST(Interrupt, LeavesAnIgnoredSignalIgnored) {
    EXPECT_EQ(code_of_child([] {
                  ::signal(SIGHUP, SIG_IGN);
                  handle_signals();
                  ::raise(SIGHUP);
                  return interrupted() ? 1 : 0;
              }),
              0);
}

using Frames = std::vector<double>;

TEST(FrameRange, ReadsNumbersAndRanges) {
    EXPECT_EQ(parse_frame_range("7"), Frames{7});
    EXPECT_EQ(parse_frame_range("2.5"), Frames{2.5});
    EXPECT_EQ(parse_frame_range("0..3"), (Frames{0, 1, 2, 3}));
    EXPECT_EQ(parse_frame_range("5..5"), Frames{5});
    EXPECT_EQ(parse_frame_range("-1..1"), (Frames{-1, 0, 1}));
    EXPECT_EQ(parse_frame_range("0..1:0.25"), (Frames{0, 0.25, 0.5, 0.75, 1}));
    EXPECT_EQ(parse_frame_range("1.5..2.:.25"), (Frames{1.5, 1.75, 2}));
    EXPECT_EQ(parse_frame_range("0..5:2"), (Frames{0, 2, 4}));
}

TEST(FrameRange, ReadsListsOfThem) {
    EXPECT_EQ(parse_frame_range("0,7,20"), (Frames{0, 7, 20}));
    EXPECT_EQ(parse_frame_range("0..8:4,20"), (Frames{0, 4, 8, 20}));
    EXPECT_EQ(parse_frame_range("-1.5,0..1,1.25,2..3:0.5"), (Frames{-1.5, 0, 1, 1.25, 2, 2.5, 3}));
    // A range ends with its last frame, which need not be B.
    EXPECT_EQ(parse_frame_range("0..5:2,5"), (Frames{0, 2, 4, 5}));
}

TEST(FrameRange, RefusesListsThatDoNotIncrease) {
    for (const char* text : {"7,0", "0,0", "0..8:4,8", "0..8,3..12", "1,2,1", "0..0.3:0.1,0.3"}) {
        EXPECT_EQ(test::kind_of([&] { parse_frame_range(text); }), ErrorKind::kBadArgument) << text;
    }
    EXPECT_EQ(
        test::message_of([] { parse_frame_range("0..8:4,20,7"); }),
        "frames '0..8:4,20,7': 7 does not come after 20; they must increase; write A, A..B or "
        "A..B:STEP, such as 0..20:0.5, or several of them with commas, such as 0,7,20");
}

TEST(FrameRange, DoesNotDrift) {
    const Frames frames = parse_frame_range("0..1000:0.1");
    ASSERT_EQ(frames.size(), 10001u);
    for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
        EXPECT_EQ(frames[i], static_cast<double>(i) * 0.1);
    }
    EXPECT_EQ(frames.back(), 1000);
}

TEST(FrameRange, IncludesTheLastFrameWhenItIsHit) {
    EXPECT_EQ(parse_frame_range("0..0.3:0.1").back(), 0.3);
    EXPECT_EQ(parse_frame_range("0..0.3:0.1").size(), 4u);
    EXPECT_EQ(parse_frame_range("0..20:0.25").size(), 81u);
    EXPECT_EQ(parse_frame_range("0..0.29:0.1").size(), 3u);
}

TEST(FrameRange, RefusesEverythingElse) {
    for (const char* text :
         {"",         "..",     "1..",      "..5",        "5..4",      "0..5:0",
          "0..5:-1",  "0..5:",  "0..5:1:2", "nan",        "nan..5",    "0..nan",
          "0..5:nan", "0..inf", "inf",      "0..5:inf",   "1e400",     "a",
          "a..b",     "0-5",    "0;5",      "0,",         ",5",        "0,,5",
          "0, 5",     "0,all",  "0..5,5",   " 1",         "1 ",        "0...",
          "0....5",   "1:2",    "0x1",      "0..1000000", "0..1:1e-7", "0..1:1e-320"}) {
        EXPECT_EQ(test::kind_of([&] { parse_frame_range(text); }), ErrorKind::kBadArgument) << text;
    }
}

TEST(FrameRange, AcceptsAMillionFrames) {
    EXPECT_EQ(parse_frame_range("1..1000000").size(), kMaxFrames);
    EXPECT_EQ(parse_frame_range("0,2..1000000").size(), kMaxFrames);
    EXPECT_EQ(test::kind_of([] { parse_frame_range("0..999999,2000000"); }),
              ErrorKind::kBadArgument);
    EXPECT_EQ(test::kind_of([] { parse_frame_range("-1,0..999999"); }), ErrorKind::kBadArgument);
}

}  // namespace
}  // namespace mray::app
