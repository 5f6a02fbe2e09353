// The parts of the viewer that need no window.
#include <gtest/gtest.h>

#include <cmath>

#include "app/cli/command_line.h"
#include "app/clip/render_command.h"
#include "app/view/box_lines.h"
#include "app/view/camera.h"
#include "app/view/copy_command.h"
#include "app/view/difference_image.h"
#include "app/view/legend.h"
#include "app/view/pixel_text.h"
#include "app/view/playback.h"
#include "app/view/strips.h"
#include "app/view/view_state.h"
#include "common/base/errors.h"
#include "common/image/heat_colours.h"
#include "common/scene/depth_range.h"
#include "scenes/source/open_scene.h"

namespace mray::app {
namespace {

constexpr ResolvedView kFront = {.eye = {0, 0, 4}, .target = {0, 0, 0}, .light = {0, 5, 0}};

Camera front_camera() { return Camera(kFront, {0, 1, 0}, 45); }

double length(const Point& p) { return std::hypot(p[0], p[1], p[2]); }

TEST(Camera, OrbitKeepsTheDistanceAndTheTarget) {
    Camera camera = front_camera();
    for (int i = 0; i < 100; ++i) camera.orbit(0.37, i % 2 == 0 ? 0.4 : -0.3);
    EXPECT_NEAR(camera.distance(), 4, 1e-9);
    EXPECT_EQ(camera.target(), (Point{0, 0, 0}));
}

TEST(Camera, OrbitGoesAroundAndBack) {
    Camera camera = front_camera();
    camera.orbit(std::acos(0.0), 0);
    EXPECT_NEAR(camera.eye()[0], 4, 1e-12);
    EXPECT_NEAR(camera.eye()[2], 0, 1e-12);
    camera.orbit(-std::acos(0.0), 0);
    EXPECT_NEAR(camera.eye()[2], 4, 1e-12);
}

TEST(Camera, OrbitStaysOffThePoles) {
    Camera camera = front_camera();
    camera.orbit(0, 100);
    EXPECT_LT(camera.eye()[1], 4);
    EXPECT_GT(camera.eye()[1], 3.99);
    EXPECT_GT(camera.eye()[2], 0.05);
    camera.orbit(0, -100);
    EXPECT_GT(camera.eye()[1], -4);
}

TEST(Camera, PanMovesWhatIsAtTheTargetWithThePointer) {
    Camera camera = front_camera();
    // The height of the image at the target.
    const double height = 2 * 4 * std::tan(std::acos(-1.0) / 8);
    camera.pan(0.5, 0.25);
    EXPECT_NEAR(camera.target()[0], -0.5 * height, 1e-12);
    EXPECT_NEAR(camera.target()[1], 0.25 * height, 1e-12);
    EXPECT_NEAR(camera.distance(), 4, 1e-12);
}

TEST(Camera, ZoomNeverReachesTheTarget) {
    Camera camera = front_camera();
    camera.zoom(0.5);
    EXPECT_NEAR(camera.distance(), 2, 1e-12);
    for (int i = 0; i < 1000; ++i) camera.zoom(0.5);
    EXPECT_NEAR(camera.distance(), 4e-6, 1e-12);
    for (int i = 0; i < 1000; ++i) camera.zoom(2);
    EXPECT_NEAR(camera.distance(), 4e6, 1e-3);
}

TEST(Camera, FliesAlongTheView) {
    Camera camera = front_camera();
    camera.fly(1, 2, 3);
    EXPECT_NEAR(length({camera.eye()[0] - 1, camera.eye()[1] - 2, camera.eye()[2] - 1}), 0, 1e-12);
    EXPECT_NEAR(camera.distance(), 4, 1e-12);
}

TEST(Playback, FramesAreMultiplesThatTextKeeps) {
    Playback playback(0, 24, 3);
    playback.playing = true;
    for (int i = 0; i < 1000; ++i) {
        playback.advance(0.0123);
        EXPECT_EQ(playback.frame() * 64, std::round(playback.frame() * 64));
        EXPECT_GE(playback.frame(), 0);
        EXPECT_LE(playback.frame(), 24);
    }
}

TEST(Playback, SmallStepsAddUp) {
    Playback playback(0, 24, 0);
    playback.playing = true;
    playback.frames_a_second = 1;
    for (int i = 0; i < 4000; ++i) playback.advance(0.001);
    EXPECT_NEAR(playback.frame(), 4, 0.02);
}

TEST(Playback, LoopsOrStopsAtTheEnd) {
    Playback playback(2, 10, 9);
    playback.playing = true;
    playback.frames_a_second = 2;
    playback.advance(1);
    EXPECT_EQ(playback.frame(), 3);
    EXPECT_TRUE(playback.playing);
    playback.loop = false;
    playback.advance(100);
    EXPECT_EQ(playback.frame(), 10);
    EXPECT_FALSE(playback.playing);
}

TEST(Playback, AClipOfOneFrameStays) {
    Playback playback(5, 5, 5);
    playback.playing = true;
    playback.advance(1e6);
    playback.step(3);
    EXPECT_EQ(playback.frame(), 5);
}

TEST(Playback, StepsByWholeFrames) {
    Playback playback(0, 10, 0);
    playback.seek(3.3);
    playback.step(1);
    EXPECT_EQ(playback.frame(), 4);
    playback.step(-9);
    EXPECT_EQ(playback.frame(), 0);
}

Options view_options(std::vector<std::string> more) {
    std::vector<std::string> line = {"view", "builtin:cloth:500", "--backend", "cpu"};
    line.insert(line.end(), more.begin(), more.end());
    return with_render_defaults(*parse_command_line(line).options);
}

ViewState state_of(const Options& options) {
    const std::unique_ptr<Clip> clip = open_scene(options.scene, {});
    return initial_state(options, *clip, BackendChoice::kCpu, 3);
}

TEST(ViewState, RefinesFromOneSampleWithoutAmbientOcclusion) {
    ViewState state = state_of(view_options({"--samples", "16"}));
    ASSERT_EQ(last_step(state), 3);
    const std::uint32_t samples[] = {1, 1, 4, 16};
    for (int step = 0; step <= 3; ++step) {
        const ImageRequest request = request_of(state, step);
        EXPECT_EQ(request.samples, samples[step]);
        EXPECT_EQ(request.view.ao_count, step == 0 ? 0u : 8u);
        EXPECT_EQ(request.is_refined(), step > 0);
    }
    state.ao_count = 0;
    EXPECT_EQ(last_step(state), 2);
    EXPECT_EQ(request_of(state, 2).samples, 16u);
    state.shading = morphray::Shading::prim;
    EXPECT_EQ(last_step(state), 2);
    EXPECT_FALSE(request_of(state, 0).is_refined());
    EXPECT_GE(request_of(state, 0).view.ao_count, 1u);
}

TEST(ViewState, SidesShareTheWidth) {
    ViewState state = state_of(view_options({"--size", "101x50"}));
    state.comparison = Comparison::kSide;
    const ImageRequest request = request_of(state, 0);
    EXPECT_EQ(request.view.width, 50u);
    EXPECT_EQ(request.view.height, 50u);
    EXPECT_EQ(request.backends, (std::vector{BackendChoice::kCpu, BackendChoice::kVulkan}));
}

TEST(ViewState, AnImpossibleViewIsRefused) {
    const Options options = view_options({"--eye", "1,1,1", "--target", "1,1,1"});
    EXPECT_THROW(state_of(options), Error);
}

TEST(ViewState, SamplesFitIntoMemory) {
    EXPECT_EQ(affordable_samples(100, 100, 1), 1u);
    EXPECT_EQ(affordable_samples(100, 100, std::uint64_t{100} * 100 * 16 * 48), 16u);
    EXPECT_EQ(affordable_samples(100, 100, std::uint64_t{1} << 40), 64u);
    EXPECT_EQ(affordable_samples(20000, 10, std::uint64_t{1} << 40), 4u);
}

TEST(CopyCommand, IsReadBackAsTheSameView) {
    const Options given = view_options({"--up", "0,0.1,1", "--fov", "33.3"});
    ViewState state = state_of(given);
    state.camera.orbit(0.1234567, 0.07);
    state.camera.fly(0.1, 0.2, 0.3);
    state.playback.seek(3.7);
    const ImageRequest request = request_of(state, 2);
    const std::string line = copy_command(given, request, {});
    std::vector<std::string> words;
    for (std::size_t begin = 0; begin < line.size();) {
        const std::size_t end = std::min(line.find(' ', begin), line.size());
        words.push_back(line.substr(begin, end - begin));
        begin = end + 1;
    }
    ASSERT_EQ(words.front(), "morphray");
    words.erase(words.begin());
    const Options read = with_render_defaults(*parse_command_line(words).options);
    EXPECT_EQ(read.view, request.view);
    EXPECT_EQ(read.shading.shading, request.shading);
    EXPECT_EQ(read.shading.samples, request.samples);
    EXPECT_EQ(std::stod(read.frames), request.frame);
}

TEST(CopyCommand, NamesHowTheSceneIsRead) {
    const std::string read = "--missing hold --build sweep";
    const Options given = view_options({"--missing", "hold", "--build", "sweep"});
    const ImageRequest request = request_of(state_of(given), 0);
    for (const std::string& command :
         {copy_command(given, request, {}), probe_command(given, request, {1, 2})})
        EXPECT_NE(command.find(read), std::string::npos) << command;
}

TEST(CopyCommand, NamesTheTreeWhereColoursShowIt) {
    const Options given = view_options({});
    ViewState state = state_of(given);
    const auto command = [&] {
        return copy_command(given, request_of(state, 0), TreeOrigin{2, true});
    };
    EXPECT_EQ(command().find("--build-at"), std::string::npos);
    state.shading = morphray::Shading::steps;
    EXPECT_NE(command().find("--build-at 2 --update refit"), std::string::npos) << command();
    EXPECT_TRUE(is_reproducible(request_of(state, 0), {2, true}));
    EXPECT_FALSE(is_reproducible(request_of(state, 0), {2, false}));
}

TracedPane pane_of(std::uint32_t width, std::vector<std::uint32_t> pixels) {
    TracedPane pane;
    pane.width = width;
    pane.height = static_cast<std::uint32_t>(pixels.size()) / width;
    pane.pixels = std::move(pixels);
    return pane;
}

TEST(DifferenceImage, ShowsEachPixelThatDiffersInABit) {
    const DifferenceImage image =
        difference_of(pane_of(2, {1, 2, 3, 4}), pane_of(2, {1, 2, 0x01000003, 4}));
    EXPECT_EQ(image.different, 1u);
    EXPECT_EQ(image.pixels,
              (std::vector<std::uint32_t>{0xFF000000, 0xFF000000, 0xFFFFFFFF, 0xFF000000}));
}

TEST(Legend, HasTheColoursAndNumbersOfTheImage) {
    const Legend steps = legend_of(morphray::Shading::steps, {});
    EXPECT_EQ(steps.colours.front(), steps_colour(1));
    EXPECT_EQ(steps.colours.back(), steps_colour(256));
    EXPECT_EQ(steps.ticks.front().text, "1");
    EXPECT_EQ(steps.ticks[2].text, "16");
    EXPECT_EQ(steps.ticks[2].place, 0.5f);
    EXPECT_EQ(steps.ticks.back().text, "256");
    const Legend sah = legend_of(morphray::Shading::sah, {});
    EXPECT_EQ(sah.colours.front(), looseness_colour(1));
    EXPECT_EQ(sah.colours.back(), looseness_colour(64));
    EXPECT_EQ(sah.ticks.back().text, "64");
    const Legend depth = legend_of(morphray::Shading::depth, {.near = 2, .range = 5});
    EXPECT_EQ(depth.colours.front(), 0xFFFFFFFFu);
    EXPECT_EQ(depth.colours.back(), 0xFF404040u);
    EXPECT_EQ(depth.ticks[0].text, "2");
    EXPECT_EQ(depth.ticks[1].text, "4.5");
    EXPECT_EQ(depth.ticks[2].text, "7");
    for (const auto shading : {morphray::Shading::lit, morphray::Shading::plain,
                               morphray::Shading::normal, morphray::Shading::prim})
        EXPECT_TRUE(legend_of(shading, {}).colours.empty());
}

TEST(DepthRange, IsTheBoundingSphereBeforeTheEye) {
    const WorldBounds bounds{{-3, -4, -12}, {3, 4, 12}};
    const DepthRange before = depth_range({0, 0, 20}, bounds);
    EXPECT_DOUBLE_EQ(before.near, 7);
    EXPECT_DOUBLE_EQ(before.range, 26);
    const DepthRange within = depth_range({0, 5, 0}, bounds);
    EXPECT_DOUBLE_EQ(within.near, 0);
    EXPECT_DOUBLE_EQ(within.range, 18);
    EXPECT_DOUBLE_EQ(depth_range({1, 2, 3}, {}).range, 1);
}

TEST(PixelNote, SaysWhatEachBackendHits) {
    PixelProbe probe{.request = {.image = {}, .pixel = {5, 7}}, .hits = {}};
    probe.request.image.backends = {BackendChoice::kCpu, BackendChoice::kVulkan};
    probe.hits.resize(2);
    EXPECT_EQ(pixel_note(probe), "pixel 5,7\ncpu: nothing\nvulkan: nothing\nequal bit by bit");
    probe.hits[1].hit = {.t = 2.5f, .u = 0, .v = 0, .prim_id = 12, .geom_id = 0};
    EXPECT_EQ(pixel_note(probe), "pixel 5,7\ncpu: nothing\nvulkan: triangle 12, t 2.5\nDIFFERENT");
    probe.hits.erase(probe.hits.begin());
    EXPECT_EQ(pixel_note(probe), "pixel 5,7\ncpu: triangle 12, t 2.5");
}

TEST(Strips, KeepTheNewestUpdates) {
    Strips strips;
    TracedImage image;
    strips.add(image);
    EXPECT_TRUE(strips.samples().empty());
    image.panes.push_back(pane_of(1, {0}));
    strips.add(image);
    EXPECT_TRUE(strips.samples().empty());
    image.panes[0].has_update = true;
    for (std::size_t i = 0; i < Strips::kLength + 7; ++i) {
        image.panes[0].update_ms = static_cast<double>(i);
        strips.add(image);
    }
    ASSERT_EQ(strips.samples().size(), Strips::kLength);
    EXPECT_EQ(strips.samples().front().update_ms, 7);
}

TEST(RateMeter, CountsTheLastSecond) {
    RateMeter meter;
    EXPECT_EQ(meter.rate(0), 0);
    for (int i = 0; i <= 100; ++i) meter.add(i * 0.05, 3);
    EXPECT_NEAR(meter.rate(5), 60, 1e-9);
    EXPECT_EQ(meter.rate(7), 0);
}

TEST(RateMeter, IsSlowBelowOneASecond) {
    RateMeter meter;
    meter.add(1, 8);
    EXPECT_EQ(meter.slow_rate(2), 0);
    meter.add(5, 8);
    EXPECT_EQ(meter.rate(5), 0);
    EXPECT_EQ(meter.slow_rate(5), 2);
    EXPECT_EQ(meter.slow_rate(7), 2);
    // The next one takes longer.
    EXPECT_EQ(meter.slow_rate(13), 1);
    meter.add(13.25, 8);
    meter.add(13.5, 8);
    EXPECT_EQ(meter.slow_rate(13.5), meter.rate(13.5));
    EXPECT_EQ(meter.rate(13.5), 32);
}

TEST(RateMeter, SaysStillOnlyWhereNothingMoves) {
    EXPECT_EQ(rate_text(0, false, "images/s"), "still");
    EXPECT_EQ(rate_text(0, true, "images/s"), "...");
    EXPECT_EQ(rate_text(0.254, true, "images/s"), "0.25 images/s");
    EXPECT_EQ(rate_text(59.96, true, "images/s"), "60.0 images/s");
}

TEST(BoxLines, AreTheEdgesOfWhatIsBeforeTheEye) {
    ViewSpec view;
    view.eye = Point{0, 0, 4};
    view.target = Point{0, 0, 0};
    view.fov = 90;
    view.width = 200;
    view.height = 100;
    const morphray::Box before[] = {{{-1, -1, -1}, {1, 1, 1}}};
    const std::vector<ImageLine> lines = box_lines(view, before);
    ASSERT_EQ(lines.size(), 12u);
    float right = 0;
    for (const ImageLine& line : lines) right = std::max({right, line.x0, line.x1});
    // The nearer face is at depth 3, where the image reaches up to 3.
    EXPECT_NEAR(right, 100 + 50.0 / 3, 1e-4);
    const morphray::Box behind[] = {{{-1, -1, 5}, {1, 1, 6}}};
    EXPECT_TRUE(box_lines(view, behind).empty());
    const morphray::Box around[] = {{{-1, -1, -5}, {1, 1, 6}}};
    for (const ImageLine& line : box_lines(view, around)) {
        EXPECT_TRUE(std::isfinite(line.x0) && std::isfinite(line.y1));
    }
}

}  // namespace
}  // namespace mray::app
