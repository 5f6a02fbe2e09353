// The thread that traces for the viewer.
#include "app/view/engine.h"

#include <gtest/gtest.h>

#include <chrono>
#include <semaphore>
#include <thread>

#include "app/animation/animation_scene.h"
#include "app/cli/command_line.h"
#include "common/base/errors.h"
#include "scenes/animation.h"
#include "tests/app/scenes.h"
#include "tests/support/temporary_folder.h"

namespace mray::app {
namespace {

class EngineTest : public testing::Test {
protected:
    explicit EngineTest(const std::string& scene = "builtin:cloth:2000")
        : given_(std::get<ViewOptions>(
              *parse_command_line(
                   std::vector<std::string>{"view", scene, "--backend", "cpu", "--size", "64x48"})
                   .options)),
          options_(given_.image),
          animation_(open_scene(scene, {})),
          state_(initial_state(given_, *animation_, 2)) {}

    std::function<void()> signal() {
        return [this] { results_.release(); };
    }
    /// The next image.
    std::unique_ptr<TracedImage> wait_for_image(Engine& engine) {
        for (;;) {
            results_.acquire();
            if (std::unique_ptr<TracedImage> image = engine.take()) return image;
        }
    }
    /// The image of this request, when it comes.
    std::unique_ptr<TracedImage> wait_for(Engine& engine, const ImageRequest& request) {
        for (;;) {
            std::unique_ptr<TracedImage> image = wait_for_image(engine);
            if (image->request == request) return image;
        }
    }

    ViewOptions given_;
    ImageOptions options_;
    std::unique_ptr<Animation> animation_;
    ViewState state_;
    Messages messages_;
    std::counting_semaphore<> results_{0};
};

TEST_F(EngineTest, ImagesAreThoseOfTheLibrary) {
    Engine engine(options_, *animation_, messages_, signal());
    for (const double frame : {2.0, 7.5, 3.25}) {
        state_.playback.seek(frame);
        const ImageRequest request = request_of(state_, last_step(state_));
        engine.post(request);
        const std::unique_ptr<TracedImage> image = wait_for(engine, request);
        ASSERT_EQ(image->panes.size(), 1u) << image->error;
        AnimationScene scene(morphray::Device::cpu(), options_, *animation_, frame, messages_);
        morphray::Image expected;
        scene.render(request.view, expected);
        EXPECT_EQ(image->panes[0].pixels, expected.pixels);
        EXPECT_EQ(image->panes[0].rays, expected.ray_count);
    }
}

TEST_F(EngineTest, TheNewestRequestIsAnswered) {
    Engine engine(options_, *animation_, messages_, signal());
    for (int i = 0; i < 200; ++i) {
        state_.playback.seek(i / 16.0);
        engine.post(request_of(state_, i % 3));
    }
    const ImageRequest last = request_of(state_, 1);
    engine.post(last);
    EXPECT_EQ(wait_for(engine, last)->error, "");
}

TEST_F(EngineTest, APixelIsProbedAfterTheImageInProgress) {
    Engine engine(options_, *animation_, messages_, signal());
    const ImageRequest request = request_of(state_, 0);
    engine.probe({request, {32, 24}});
    engine.post(request);
    wait_for(engine, request);
    const std::optional<PixelProbe> probe = engine.take_probe();
    ASSERT_TRUE(probe.has_value());
    ASSERT_EQ(probe->hits.size(), 1u);
    EXPECT_TRUE(probe->hits[0]);
}

TEST_F(EngineTest, AProbeInterruptsARefinementThatGoesOnAfterwards) {
    Engine engine(options_, *animation_, messages_, signal());
    state_.view.width = 600;
    state_.view.height = 400;
    const ImageRequest request = request_of(state_, last_step(state_));
    engine.post(request);
    engine.probe({request, {300, 200}});
    EXPECT_EQ(wait_for(engine, request)->error, "");
    EXPECT_TRUE(engine.take_probe().has_value());
}

TEST_F(EngineTest, EndsWhileItTraces) {
    state_.view.width = 400;
    state_.view.height = 300;
    state_.view.samples = 16;
    for (int i = 0; i < 8; ++i) {
        Engine engine(options_, *animation_, messages_, signal());
        const ImageRequest first = request_of(state_, 0);
        engine.post(first);
        wait_for(engine, first);
        engine.post(request_of(state_, last_step(state_)));
        // At one of several moments of the image, or after it.
        std::this_thread::sleep_for(std::chrono::milliseconds(4 * i));
        if (i % 2 == 0) engine.post(request_of(state_, 1));
    }
}

TEST_F(EngineTest, AnErrorOfALaterRequestIsShownAndMended) {
    Engine engine(options_, *animation_, messages_, signal());
    const ImageRequest good = request_of(state_, 0);
    engine.post(good);
    EXPECT_EQ(wait_for(engine, good)->error, "");
    ImageRequest bad = good;
    bad.view.target = bad.view.eye;
    engine.post(bad);
    const std::unique_ptr<TracedImage> refused = wait_for(engine, bad);
    EXPECT_NE(refused->error, "");
    EXPECT_TRUE(refused->panes.empty());
    engine.post(good);
    EXPECT_EQ(wait_for(engine, good)->error, "");
}

TEST_F(EngineTest, AnErrorOfTheFirstRequestIsThrown) {
    Engine engine(options_, *animation_, messages_, signal());
    ImageRequest bad = request_of(state_, 0);
    bad.view.target = bad.view.eye;
    engine.post(bad);
    EXPECT_THROW(wait_for_image(engine), Error);
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
    Engine engine(options_, *animation_, messages_, signal());
    const auto pixels_of = [&](morphray::Shading shading, std::optional<bool> ground) {
        ImageRequest request = request_of(state_, 0);
        request.view.shading = shading;
        request.view.ao_count = 1;
        ImageOptions options = options_;
        options.ground = ground;
        Engine other(options, *animation_, messages_, signal());
        (ground ? other : engine).post(request);
        return wait_for(ground ? other : engine, request)->panes.at(0).pixels;
    };
    using morphray::Shading;
    EXPECT_EQ(pixels_of(Shading::lit, {}), pixels_of(Shading::lit, true));
    EXPECT_EQ(pixels_of(Shading::depth, {}), pixels_of(Shading::depth, false));
    state_.camera.orbit(0, -1);
    EXPECT_EQ(pixels_of(Shading::lit, {}), pixels_of(Shading::lit, false));
}

TEST_F(EngineTest, BoxesAreThoseOfTheTree) {
    Engine engine(options_, *animation_, messages_, signal());
    state_.box_depth = 0;
    ImageRequest request = request_of(state_, 0);
    engine.post(request);
    const std::unique_ptr<TracedImage> root = wait_for(engine, request);
    ASSERT_EQ(root->boxes.size(), 1u);
    request.box_depth = 1;
    engine.post(request);
    const std::unique_ptr<TracedImage> children = wait_for(engine, request);
    EXPECT_GT(children->boxes.size(), 1u);
    EXPECT_LE(children->boxes.size(), 16u);
    for (const morphray::Box& box : children->boxes) {
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_GE(box.lower[k], root->boxes[0].lower[k]);
            EXPECT_LE(box.upper[k], root->boxes[0].upper[k]);
        }
    }
}

}  // namespace
}  // namespace mray::app
