// The parts of the viewer that need no window.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/animation/animation_scene.h"
#include "app/cli/command_line.h"
#include "app/view/engine.h"
#include "app/view/window.h"
#include "common/base/errors.h"
#include "common/image/depth.h"
#include "scenes/animation.h"

namespace mray::app {
namespace {

Camera front_camera() {
    return Camera({.eye = morphray::Point{0, 0, 4}, .target = morphray::Point{0, 0, 0}});
}

TEST(Camera, OrbitKeepsTheDistanceAndTheTarget) {
    Camera camera = front_camera();
    for (int i = 0; i < 100; ++i) camera.orbit(0.37, i % 2 == 0 ? 0.4 : -0.3);
    EXPECT_NEAR(camera.distance(), 4, 1e-9);
    EXPECT_EQ(camera.target(), (morphray::Point{0, 0, 0}));
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

TEST(Playback, BeginsAgainAtTheEnd) {
    Playback playback(2, 10, 9);
    playback.playing = true;
    playback.frames_a_second = 2;
    playback.advance(1);
    EXPECT_EQ(playback.frame(), 3);
}

TEST(Playback, AAnimationOfOneFrameStays) {
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

ViewOptions view_options(std::vector<std::string> more) {
    std::vector<std::string> line = {"view", "builtin:cloth:500", "--backend", "cpu"};
    line.insert(line.end(), more.begin(), more.end());
    return std::get<ViewOptions>(*parse_command_line(line).options);
}

ViewState state_of(const ViewOptions& options) {
    const std::unique_ptr<Animation> animation = open_scene(options.image.source.scene, {});
    return initial_state(options, *animation, 3);
}

TEST(ViewState, RefinesFromOneSampleWithoutAmbientOcclusion) {
    ViewState state = state_of(view_options({"--samples", "16"}));
    ASSERT_EQ(last_step(state), 3);
    const std::uint32_t samples[] = {1, 1, 4, 16};
    for (int step = 0; step <= 3; ++step) {
        const ImageRequest request = request_of(state, step);
        EXPECT_EQ(request.view.samples, samples[step]);
        EXPECT_EQ(request.view.ao_count, step == 0 ? 0u : 8u);
        EXPECT_EQ(request.is_refined(), step > 0);
    }
    state.view.ao_count = 0;
    EXPECT_EQ(last_step(state), 2);
    EXPECT_EQ(request_of(state, 2).view.samples, 16u);
    state.view.shading = morphray::Shading::prim;
    EXPECT_EQ(last_step(state), 2);
    EXPECT_FALSE(request_of(state, 0).is_refined());
    EXPECT_GE(request_of(state, 0).view.ao_count, 1u);
}

TEST(ViewState, AnImpossibleViewIsRefused) {
    const ViewOptions options = view_options({"--eye", "1,1,1", "--target", "1,1,1"});
    EXPECT_THROW(state_of(options), Error);
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

TEST(DepthRange, IsThatOfTheCornersBeforeTheEye) {
    const WorldBounds bounds{{-3, -4, -12}, {3, 4, 12}};
    const DepthRange before = depth_range({0, 0, 20}, {0, 0, 0}, bounds);
    EXPECT_DOUBLE_EQ(before.near, 8);
    EXPECT_DOUBLE_EQ(before.range, 24);
    const DepthRange within = depth_range({0, 0, 7}, {0, 0, 8}, bounds);
    EXPECT_DOUBLE_EQ(within.near, 0);
    EXPECT_DOUBLE_EQ(within.range, 5);
    const DepthRange flat = depth_range({0, 0, 2}, {0, 0, 0}, {{-1, -1, 0}, {1, 1, 0}});
    EXPECT_DOUBLE_EQ(flat.near, 2);
    EXPECT_GT(flat.range, 0);
    EXPECT_DOUBLE_EQ(depth_range({1, 2, 3}, {0, 0, 0}, {}).range, 1);
}

TEST(PixelText, SaysWhatEachBackendHits) {
    PixelProbe probe{.request = {.image = {}, .pixel = {5, 7}}, .devices = {"a", "b"}, .hits = {}};
    probe.hits.resize(2);
    EXPECT_EQ(pixel_text(probe), "pixel 5,7, frame 0\na\n  miss\nb\n  miss\nequal bit by bit\n");
    probe.hits[1] = {.t = 2.5f, .u = 0, .v = 0, .prim_id = 12, .geom_id = 0};
    const std::string text = pixel_text(probe);
    EXPECT_NE(text.find("b\n  triangle 12\n  t 0x1.4p+1          2.5\n"), std::string::npos)
        << text;
    EXPECT_TRUE(text.ends_with("DIFFERENT\n")) << text;
}

TEST(BoxLines, AreTheEdgesOfWhatIsBeforeTheEye) {
    morphray::View view;
    view.eye = morphray::Point{0, 0, 4};
    view.target = morphray::Point{0, 0, 0};
    view.fov = 90;
    view.width = 200;
    view.height = 100;
    const morphray::Box before[] = {{{-1, -1, -1}, {1, 1, 1}}};
    const std::vector<glm::vec4> ends = box_lines(view, before);
    ASSERT_EQ(ends.size(), 24u);
    float right = 0;
    for (const glm::vec4& end : ends) right = std::max(right, end.x / end.w);
    // The nearer face is at depth 3, where the image reaches up to 6.
    EXPECT_NEAR(right, 1 / 6.0, 1e-6);
    const morphray::Box behind[] = {{{-1, -1, 5}, {1, 1, 6}}};
    for (const glm::vec4& end : box_lines(view, behind)) EXPECT_LT(end.w, 0);
}

}  // namespace
}  // namespace mray::app
