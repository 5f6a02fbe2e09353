// The scene of the viewer on one backend.
#pragma once

#include <atomic>
#include <optional>

#include "app/clip/clip_scene.h"
#include "app/view/image_request.h"

namespace mray::app {

/// Follows requests: deforms, updates and traces as render does. Members throw Error.
class TracedScene {
public:
    /// The clip, the messages, `stops`, which ends the building of trees, and `builds` must outlive
    /// it. Nothing is built before the first request.
    /// `builds` is true while a tree is built.
    TracedScene(const Options& options, const Clip& clip, BackendChoice backend,
                const Messages& messages, const std::atomic<bool>& stops,
                std::atomic<bool>& builds);

    /// Throws Error(kCancelled) soon after `cancel` or, while a tree is built, `stops` becomes
    /// true.
    TracedPane trace(const ImageRequest& request, const std::atomic<bool>& cancel);

    /// The hit of a pixel's camera ray, its t in units of world space along the view, and the
    /// positions of its triangle.
    struct PixelHit {
        morphray::Hit hit;
        uvec3 vertices = {0, 0, 0};
        vec3 corners[3] = {};
    };
    PixelHit probe(const ImageRequest& request, Pixel pixel);

    std::vector<morphray::Box> tree_boxes(std::uint32_t depth) const;

private:
    bool follow(const ImageRequest& request);
    void note_tree(double frame);

    Options options_;
    const Clip& clip_;
    BackendChoice backend_;
    const Messages& messages_;
    const std::atomic<bool>& stops_;
    std::atomic<bool>& builds_;
    std::optional<ClipScene> scene_;
    SceneSettings settings_;
    double frame_ = 0;
    TreeOrigin tree_;
    /// The image of the request before, whose memory the next one uses.
    morphray::Image image_;
};

}  // namespace mray::app
