// Traces what the viewer asks for, in a thread of its own.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "app/animation/animation_scene.h"
#include "app/view/state.h"

namespace mray::app {

struct TracedPane {
    std::string device = {};
    std::vector<std::uint32_t> pixels = {};
    std::uint64_t rays = 0;
    double deform_ms = 0;
    double trace_ms = 0;
    morphray::Update update = {};
    /// Of the pixel that was asked for; t is in world space along the view.
    morphray::Hit hit = {};
};

struct TracedImage {
    ImageRequest request;
    /// As many as there are backends, or none if `error` is set.
    std::vector<TracedPane> panes;
    std::vector<morphray::Box> boxes;
    /// Of scale_text().
    std::string scale;
    std::string error;
};

/// White where two images of one size differ in any bit, black where they are equal.
struct DifferenceImage {
    std::vector<std::uint32_t> pixels;
    std::uint64_t different = 0;
};
DifferenceImage difference_of(const TracedPane& first, const TracedPane& second);

/// For each backend triangle, t, u and v in both digits; with two, whether they are equal.
std::string pixel_text(const TracedImage& image);

/// Only the newest request counts: it replaces a waiting one and cancels a refinement. All members
/// may be called from one thread while the engine works in its own.
class Engine {
public:
    /// Calls `on_result` in its thread when there is something to take. Arguments must outlive it.
    Engine(const Options& options, const Animation& animation, const Messages& messages,
           std::function<void()> on_result);
    /// Cancels, and waits for the thread.
    ~Engine();
    Engine(const Engine&) = delete;
    Engine& operator=(const Engine&) = delete;

    void post(ImageRequest request);
    /// The newest answer since the last call, or null. Throws the loss of a device, or any error
    /// before the first image.
    std::unique_ptr<TracedImage> take();

private:
    /// The animation on one backend, at the frame of the last request.
    struct BackendScene {
        PolicySpec update;
        double frame = 0;
        std::unique_ptr<AnimationScene> scene;
        /// Its memory is used by the next image.
        morphray::Image image;
    };

    void run();
    std::optional<ImageRequest> next();
    void trace(const ImageRequest& request);
    TracedPane trace(const ImageRequest& request, BackendChoice backend);
    BackendScene& follow(const ImageRequest& request, BackendChoice backend);

    const Options& options_;
    const Animation& animation_;
    const Messages& messages_;
    std::function<void()> on_result_;
    std::atomic<bool> stops_ = false;
    /// Scenes that the engine's thread alone uses.
    std::map<std::pair<BackendChoice, bool>, BackendScene> scenes_;
    bool has_traced_ = false;

    std::mutex mutex_;
    std::condition_variable wakes_;
    std::optional<ImageRequest> next_;
    /// Whether the image in progress is one that a newer request cancels.
    bool is_refining_ = false;
    std::atomic<bool> cancel_ = false;
    std::unique_ptr<TracedImage> image_;
    std::exception_ptr failure_;
    std::thread thread_;
};

}  // namespace mray::app
