// Traces what the viewer asks for, in a thread of its own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "app/view/traced_scene.h"

namespace mray::app {

/// A pixel to describe.
struct ProbeRequest {
    ImageRequest image;
    Pixel pixel;
};

/// The hits of a pixel, one for each backend of the image.
struct PixelProbe {
    ProbeRequest request;
    std::vector<TracedScene::PixelHit> hits;
};

/// Only the newest request counts: one that has not begun is replaced, and one that refines an
/// image is cancelled. A probe goes first, and interrupts such an image. All members may be called
/// from one thread while the engine works in its own.
class Engine {
public:
    /// `on_result` is called in the engine's thread whenever there is something to take. Messages,
    /// options, clip and on_result's context must outlive the engine.
    Engine(const Options& options, const Clip& clip, const Messages& messages,
           std::function<void()> on_result);
    /// Cancels, and waits for the thread. After a signal the process may end before that.
    ~Engine();
    Engine(const Engine&) = delete;
    Engine& operator=(const Engine&) = delete;

    void post(ImageRequest request);
    void probe(ProbeRequest request);
    /// The newest image since the last call, or null. After an error that no other request can mend
    /// it throws that: the loss of a device, or anything before the first image.
    std::unique_ptr<TracedImage> take();
    std::optional<PixelProbe> take_probe();
    /// Whether a scene is made: textures are read and a tree is built, which says how far it is to
    /// step_done() (app/terminal/progress.h).
    bool builds() const { return builds_; }

private:
    void run();
    bool next(std::optional<ImageRequest>& image, std::optional<ProbeRequest>& probe);
    void trace(const ImageRequest& request);
    void answer(const ProbeRequest& request);
    TracedScene& scene(BackendChoice backend);

    const Options& options_;
    const Clip& clip_;
    const Messages& messages_;
    std::function<void()> on_result_;
    std::atomic<bool> stops_ = false;
    std::atomic<bool> builds_ = false;
    /// Scenes that the engine's thread alone uses.
    std::map<BackendChoice, TracedScene> scenes_;
    bool has_traced_ = false;

    std::mutex mutex_;
    std::condition_variable wakes_;
    std::optional<ImageRequest> next_image_;
    std::optional<ProbeRequest> next_probe_;
    /// Whether the image in progress is one that a newer request cancels.
    bool is_refining_ = false;
    std::atomic<bool> cancel_ = false;
    std::unique_ptr<TracedImage> image_;
    std::optional<PixelProbe> probe_;
    std::exception_ptr failure_;
    std::thread thread_;
};

}  // namespace mray::app
