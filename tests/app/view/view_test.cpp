// The parts of the viewer that need no window, and the thread that traces for it.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <semaphore>
#include <thread>

#include "app/animation/animation_scene.h"
#include "app/cli/command_line.h"
#include "app/view/engine.h"
#include "common/base/errors.h"
#include "common/image/depth.h"
#include "scenes/animation.h"
#include "tests/app/scenes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text.h"

namespace mray::app {
namespace {

Camera front_camera() {
    return Camera({.eye = morphray::Point{0, 0, 4}, .target = morphray::Point{0, 0, 0}});
}

TEST(Camera, OrbitKeepsTheDistanceAndTheTarget) {
    Camera camera = front_camera();
    for (int i = 0; i < 100; ++i) camera.orbit(0.37, i % 2 == 0 ? 0.4 : -0.3);
    EXPECT_NEAR(camera.distance(), 4, 1e-9);
    EXPECT_EQ(camera.target, glm::dvec3(0));
}

TEST(Camera, OrbitGoesAroundAndBack) {
    Camera camera = front_camera();
    camera.orbit(std::acos(0.0), 0);
    EXPECT_NEAR(camera.eye[0], 4, 1e-12);
    EXPECT_NEAR(camera.eye[2], 0, 1e-12);
    camera.orbit(-std::acos(0.0), 0);
    EXPECT_NEAR(camera.eye[2], 4, 1e-12);
}

TEST(Camera, OrbitStaysOffThePoles) {
    Camera camera = front_camera();
    camera.orbit(0, 100);
    EXPECT_LT(camera.eye[1], 4);
    EXPECT_GT(camera.eye[1], 3.99);
    EXPECT_GT(camera.eye[2], 0.05);
    camera.orbit(0, -100);
    EXPECT_GT(camera.eye[1], -4);
}

TEST(Camera, PanMovesWhatIsAtTheTargetWithThePointer) {
    Camera camera = front_camera();
    // The height of the image at the target.
    const double height = 2 * 4 * std::tan(std::acos(-1.0) / 8);
    camera.pan(0.5, 0.25);
    EXPECT_NEAR(camera.target[0], -0.5 * height, 1e-12);
    EXPECT_NEAR(camera.target[1], 0.25 * height, 1e-12);
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
    Playback playback{2, 10, 9};
    playback.playing = true;
    playback.frames_a_second = 2;
    playback.advance(1);
    EXPECT_EQ(playback.frame, 3);
}

TEST(Playback, AAnimationOfOneFrameStays) {
    Playback playback{5, 5, 5};
    playback.playing = true;
    playback.advance(1e6);
    playback.step(3);
    EXPECT_EQ(playback.frame, 5);
}

TEST(Playback, StepsByWholeFrames) {
    Playback playback{0, 10, 0};
    playback.seek(3.3);
    playback.step(1);
    EXPECT_EQ(playback.frame, 4);
    playback.step(-9);
    EXPECT_EQ(playback.frame, 0);
}

Options view_options(std::vector<std::string> more) {
    std::vector<std::string> line = {"view", "builtin:cloth:500", "--backend", "cpu"};
    line.insert(line.end(), more.begin(), more.end());
    return *parse_command_line(line).options;
}

ViewState state_of(const Options& options) {
    const std::unique_ptr<Animation> animation = open_scene(options.source.scene, {});
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
    const Options options = view_options({"--eye", "1,1,1", "--target", "1,1,1"});
    EXPECT_THROW(state_of(options), Error);
}

TEST(DifferenceImage, ShowsEachPixelThatDiffersInABit) {
    const DifferenceImage image =
        difference_of({.pixels = {1, 2, 3, 4}}, {.pixels = {1, 2, 0x01000003, 4}});
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
    TracedImage image;
    image.request.pixel = {5, 7};
    image.panes = {{.device = "a"}, {.device = "b"}};
    EXPECT_EQ(pixel_text(image), "pixel 5,7, frame 0\na\n  miss\nb\n  miss\nequal bit by bit\n");
    image.panes[1].hit = {.t = 2.5f, .u = 0, .v = 0, .prim_id = 12, .geom_id = 0};
    const std::string text = pixel_text(image);
    EXPECT_TRUE(test::has(text, "b\n  triangle 12\n  t 0x1.4p+1          2.5\n"));
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

class EngineTest : public testing::Test {
protected:
    explicit EngineTest(const std::string& scene = "builtin:cloth:2000")
        : options_(*parse_command_line(std::vector<std::string>{"view", scene, "--backend", "cpu",
                                                                "--size", "64x48"})
                        .options),
          animation_(open_scene(scene, {})),
          state_(initial_state(options_, *animation_, 2)) {
        start();
    }

    /// Ends the engine and makes another one.
    void start() {
        engine_.emplace(options_, *animation_, messages_, [this] { results_.release(); });
    }
    /// The next image.
    std::unique_ptr<TracedImage> wait_for_image() {
        for (;;) {
            results_.acquire();
            if (std::unique_ptr<TracedImage> image = engine_->take()) return image;
        }
    }
    /// The image of this request, when it comes.
    std::unique_ptr<TracedImage> wait_for(const ImageRequest& request) {
        for (;;) {
            std::unique_ptr<TracedImage> image = wait_for_image();
            if (image->request == request) return image;
        }
    }
    std::unique_ptr<TracedImage> trace(const ImageRequest& request) {
        engine_->post(request);
        return wait_for(request);
    }

    Options options_;
    std::unique_ptr<Animation> animation_;
    ViewState state_;
    Messages messages_;
    std::counting_semaphore<> results_{0};
    std::optional<Engine> engine_;
};

TEST_F(EngineTest, ImagesAreThoseOfTheLibrary) {
    for (const double frame : {2.0, 7.5, 3.25}) {
        state_.playback.seek(frame);
        const ImageRequest request = request_of(state_, last_step(state_));
        const std::unique_ptr<TracedImage> image = trace(request);
        ASSERT_EQ(image->panes.size(), 1u) << image->error;
        AnimationScene scene(morphray::Device::cpu(), options_, *animation_, frame, messages_);
        morphray::Image expected;
        scene.render(request.view, expected);
        EXPECT_EQ(image->panes[0].pixels, expected.pixels);
        EXPECT_EQ(image->panes[0].rays, expected.ray_count);
    }
}

TEST_F(EngineTest, TheNewestRequestIsAnswered) {
    for (int i = 0; i < 200; ++i) {
        state_.playback.seek(i / 16.0);
        engine_->post(request_of(state_, i % 3));
    }
    EXPECT_EQ(trace(request_of(state_, 1))->error, "");
}

TEST_F(EngineTest, AskedAboutAPixelItAnswersWithItsHit) {
    ImageRequest request = request_of(state_, 0);
    EXPECT_FALSE(trace(request)->panes.at(0).hit);
    request.pixel = {32, 24};
    EXPECT_TRUE(trace(request)->panes.at(0).hit);
    request.pixel = {0, 0};
    EXPECT_FALSE(trace(request)->panes.at(0).hit);
}

TEST_F(EngineTest, EndsWhileItTraces) {
    state_.view.width = 400;
    state_.view.height = 300;
    state_.view.samples = 16;
    for (int i = 0; i < 8; ++i) {
        start();
        trace(request_of(state_, 0));
        engine_->post(request_of(state_, last_step(state_)));
        // At one of several moments of the image, or after it.
        std::this_thread::sleep_for(std::chrono::milliseconds(4 * i));
        if (i % 2 == 0) engine_->post(request_of(state_, 1));
    }
}

TEST_F(EngineTest, AnErrorOfALaterRequestIsShownAndMended) {
    const ImageRequest good = request_of(state_, 0);
    EXPECT_EQ(trace(good)->error, "");
    ImageRequest bad = good;
    bad.view.target = bad.view.eye;
    const std::unique_ptr<TracedImage> refused = trace(bad);
    EXPECT_NE(refused->error, "");
    EXPECT_TRUE(refused->panes.empty());
    EXPECT_EQ(trace(good)->error, "");
}

TEST_F(EngineTest, AnErrorOfTheFirstRequestIsThrown) {
    ImageRequest bad = request_of(state_, 0);
    bad.view.target = bad.view.eye;
    engine_->post(bad);
    EXPECT_THROW(wait_for_image(), Error);
}

const test::TemporaryFolder& folder() {
    static const test::TemporaryFolder folder;
    return folder;
}

class FileEngineTest : public EngineTest {
protected:
    FileEngineTest() : EngineTest(folder().write("a.obj", test::cube())) {}
};

TEST_F(FileEngineTest, TheGroundHidesNothingFromBelowAndInOtherColours) {
    const auto pixels_of = [&](morphray::Shading shading, std::optional<bool> ground) {
        ImageRequest request = request_of(state_, 0);
        request.view.shading = shading;
        request.view.ao_count = 1;
        options_.ground = ground;
        start();
        return trace(request)->panes.at(0).pixels;
    };
    using morphray::Shading;
    EXPECT_EQ(pixels_of(Shading::lit, {}), pixels_of(Shading::lit, true));
    EXPECT_EQ(pixels_of(Shading::depth, {}), pixels_of(Shading::depth, false));
    state_.camera.orbit(0, -1);
    EXPECT_EQ(pixels_of(Shading::lit, {}), pixels_of(Shading::lit, false));
}

TEST_F(EngineTest, BoxesAreThoseOfTheTree) {
    state_.box_depth = 0;
    ImageRequest request = request_of(state_, 0);
    const std::unique_ptr<TracedImage> root = trace(request);
    ASSERT_EQ(root->boxes.size(), 1u);
    request.box_depth = 1;
    const std::unique_ptr<TracedImage> children = trace(request);
    EXPECT_GT(children->boxes.size(), 1u);
    EXPECT_LE(children->boxes.size(), 16u);
}

}  // namespace
}  // namespace mray::app
