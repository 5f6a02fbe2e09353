// Scenes that the viewer opens, and turns that it records, without a window.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "app/cli/command_line.h"
#include "app/clip/render_command.h"
#include "app/files/png_reader.h"
#include "app/view/tasks/recording.h"
#include "app/view/tasks/scene_opening.h"
#include "common/base/errors.h"
#include "tests/support/temporary_folder.h"

namespace mray::app {
namespace {

namespace fs = std::filesystem;

Options options_of(const std::string& scene, const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {"view", scene, "--backend", "cpu", "--size", "32x24"};
    line.insert(line.end(), more.begin(), more.end());
    return with_render_defaults(*parse_command_line(line).options);
}

std::unique_ptr<ViewedScene> viewed(const Options& options, const Messages& messages) {
    return open_viewed_scene(
        options, messages, [] {}, interrupt_flag());
}

/// The scene when it is opened.
std::unique_ptr<ViewedScene> wait_for(SceneOpening& opening) {
    for (;;) {
        if (std::unique_ptr<ViewedScene> scene = opening.take()) return scene;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

std::unique_ptr<TracedImage> image_of(Engine& engine, const ImageRequest& request) {
    engine.post(request);
    for (;;) {
        std::unique_ptr<TracedImage> image = engine.take();
        if (image && image->request == request) return image;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

class SceneOpeningTest : public testing::Test {
protected:
    Messages messages_;
    Options options_ = options_of("builtin:cloth:2000", {"--frame", "3", "--eye", "1,2,3"});
    std::unique_ptr<ViewedScene> shown_ = viewed(options_, messages_);
};

TEST_F(SceneOpeningTest, GivesTheSceneWithItsFirstImage) {
    ViewState state = shown_->first_state;
    state.shading = morphray::Shading::normal;
    state.playback.frames_a_second = 12;
    state.edit.shake = 0.1f;
    SceneOpening opening("builtin:twist:1000", options_, state, messages_, [] {});
    const std::unique_ptr<ViewedScene> scene = wait_for(opening);
    EXPECT_EQ(scene->clip->name(), "twist");
    const std::unique_ptr<TracedImage> image = opening.first_image();
    ASSERT_EQ(image->panes.size(), 1u);
    const ViewState expected = continued_state(scene->first_state, state);
    EXPECT_EQ(image->request, request_of(expected, 0));
    EXPECT_EQ(expected.shading, morphray::Shading::normal);
    EXPECT_EQ(expected.playback.frames_a_second, 12);
    EXPECT_EQ(expected.playback.frame(), scene->clip->first_frame());
    EXPECT_TRUE(expected.edit.empty());
    EXPECT_EQ(expected.camera,
              viewed(options_of("builtin:twist:1000"), messages_)->first_state.camera);
}

TEST_F(SceneOpeningTest, SaysWhatIsWrongWithAScene) {
    test::TemporaryFolder folder;
    folder.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    for (const std::string& name : {folder.file("bad.obj"), folder.file("none.obj"),
                                    std::string("builtin:nothing"), std::string("a_%d_%d.obj")}) {
        SceneOpening opening(name, options_, shown_->first_state, messages_, [] {});
        EXPECT_THROW(wait_for(opening), Error) << name;
    }
    // The scene that is shown goes on.
    EXPECT_EQ(image_of(shown_->engine, request_of(shown_->first_state, 0))->error, "");
}

TEST_F(SceneOpeningTest, EndsWhileItReadsAndWhileItBuilds) {
    for (const int ms : {0, 5, 50}) {
        SceneOpening opening("builtin:hair:400000", options_, shown_->first_state, messages_,
                             [] {});
        std::this_thread::sleep_for(std::chrono::milliseconds(ms));
        if (ms == 50)
            while (!opening.builds() && !opening.take())
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

TEST_F(SceneOpeningTest, TakesNothingOverThatBelongsToTheOtherScene) {
    const Options shown =
        options_of("x.gltf", {"--frame", "3", "--eye", "1,2,3", "--fps", "12", "--build", "sweep"});
    const Options options = options_for("x.obj", shown);
    EXPECT_EQ(options.scene, "x.obj");
    EXPECT_FALSE(options.frame_given);
    EXPECT_FALSE(options.fps);
    EXPECT_FALSE(options.view.eye);
    EXPECT_EQ(options.view_arguments, (std::vector<std::string>{"--build", "sweep"}));
    EXPECT_EQ(options.view.width, 32u);
}

class RecordingTest : public testing::Test {
protected:
    RecordingTest() : before_(fs::current_path()) { fs::current_path(folder_.path()); }
    ~RecordingTest() override { fs::current_path(before_); }

    test::TemporaryFolder folder_;
    fs::path before_;
    Messages messages_;
};

TEST_F(RecordingTest, HasEachWholeFrameOnce) {
    const auto scene = viewed(options_of("builtin:cloth:2000", {"--frame", "2.5"}), messages_);
    ViewState state = scene->first_state;
    state.comparison = Comparison::kSide;
    state.box_depth = 2;
    const std::vector<ImageRequest> turn = turn_of(state, *scene->clip, 4);
    ASSERT_EQ(turn.size(), static_cast<std::size_t>(scene->clip->last_frame()) + 1);
    for (std::size_t i = 0; i < turn.size(); ++i) {
        EXPECT_EQ(turn[i].frame, static_cast<double>(i));
        EXPECT_EQ(turn[i].samples, 4u);
        EXPECT_EQ(turn[i].view.width, 32u);
        EXPECT_EQ(turn[i].view.eye, turn[0].view.eye);
        EXPECT_EQ(turn[i].backends, std::vector<BackendChoice>{BackendChoice::kCpu});
        EXPECT_EQ(turn[i].box_depth, -1);
    }
}

TEST_F(RecordingTest, GoesAroundASceneThatIsStill) {
    folder_.write("still.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const auto scene = viewed(options_of("still.obj"), messages_);
    const std::vector<ImageRequest> turn = turn_of(scene->first_state, *scene->clip, 1);
    ASSERT_EQ(turn.size(), 120u);
    const auto [x, y, z] = scene->first_state.camera.target();
    for (const ImageRequest& request : turn) EXPECT_EQ(request.view.target, (Point{x, y, z}));
    // Half of it is on the other side.
    const Point& eye = *turn[0].view.eye;
    const Point& opposite = *turn[60].view.eye;
    EXPECT_NEAR(eye[0] + opposite[0], 2 * x, 1e-9);
    EXPECT_NEAR(eye[1], opposite[1], 1e-9);
    EXPECT_NEAR(eye[2] + opposite[2], 2 * z, 1e-9);
}

TEST_F(RecordingTest, WritesTheImagesIntoAFreeFolder) {
    fs::create_directory("morphray_turn_0001");
    folder_.write("morphray_turn_0002.mp4", "a film");
    const auto scene = viewed(options_of("builtin:cloth:200"), messages_);
    const ViewState& state = scene->first_state;
    Recording recording(state, *scene->clip, scene->options, 1);
    const std::size_t total = turn_of(state, *scene->clip, 1).size();
    EXPECT_EQ(recording.activity(), "recording 1 of " + std::to_string(total));
    while (const ImageRequest* request = recording.wanted()) {
        const std::unique_ptr<TracedImage> image = image_of(scene->engine, *request);
        const std::string name = fs::path("morphray_turn_0003") /
                                 ("frame_" + std::string(request->frame < 10 ? "000" : "00") +
                                  std::to_string(static_cast<int>(request->frame)) + ".png");
        EXPECT_FALSE(fs::exists(name));
        recording.add(*image);
        EXPECT_EQ(read_png(name).pixels, image->panes[0].pixels);
    }
    while (!recording.is_done()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_TRUE(
        recording.summary().starts_with(std::to_string(total) + " images in morphray_turn_0003"))
        << recording.summary();
}

TEST_F(RecordingTest, KeepsTheImagesOfOneThatIsEndedEarly) {
    const auto scene = viewed(options_of("builtin:cloth:200"), messages_);
    {
        Recording recording(scene->first_state, *scene->clip, scene->options, 1);
        for (int i = 0; i < 2; ++i) recording.add(*image_of(scene->engine, *recording.wanted()));
        EXPECT_FALSE(recording.is_done());
        EXPECT_EQ(recording.summary(), "2 images in morphray_turn_0001");
    }
    EXPECT_EQ(folder_.names(),
              (std::vector<std::string>{"morphray_turn_0001", "morphray_turn_0001/frame_0000.png",
                                        "morphray_turn_0001/frame_0001.png"}));
}

TEST_F(RecordingTest, LeavesNoFolderWithoutAnImage) {
    const auto scene = viewed(options_of("builtin:cloth:200"), messages_);
    {
        Recording recording(scene->first_state, *scene->clip, scene->options, 1);
        EXPECT_TRUE(fs::is_directory("morphray_turn_0001"));
        EXPECT_EQ(recording.summary(), "no image is written");
        TracedImage failed;
        failed.error = "no such light";
        EXPECT_THROW(recording.add(failed), Error);
    }
    EXPECT_TRUE(fs::is_empty(folder_.path()));
}

}  // namespace
}  // namespace mray::app
