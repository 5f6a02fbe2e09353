// An image that the viewer asks for, and what comes back.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "morphray/scene.hpp"

namespace mray::app {

/// The settings that a scene is made with. A change makes a new scene.
struct SceneSettings {
    PolicySpec update;
    bool ground = false;
    bool operator==(const SceneSettings&) const = default;
};

struct ImageRequest {
    double frame = 0;
    /// Eye, target and light are given. Width and height are those of the image of one backend.
    ViewSpec view;
    morphray::Shading shading = morphray::Shading::lit;
    std::uint32_t samples = 1;
    bool flat = false;
    SceneSettings scene;
    /// One backend, or two to compare: kCpu, kVulkan or kBrute.
    std::vector<BackendChoice> backends;
    /// The depth of the boxes that are wanted from the first backend's tree; below 0 for none.
    int box_depth = -1;

    bool operator==(const ImageRequest&) const = default;

    /// Whether it takes so long that a newer request should end it.
    bool is_refined() const {
        const bool has_ao = shading == morphray::Shading::lit && view.ao_count > 0;
        return samples > 1 || has_ao;
    }
};

/// How the tree of an image came about, for a command that makes it again.
struct TreeOrigin {
    /// The frame that it was built at.
    double built_at = 0;
    /// Whether the tree is that build refitted, and nothing else.
    bool is_refitted = true;
};

/// The image of one backend.
struct TracedPane {
    BackendChoice backend = BackendChoice::kCpu;
    std::string device;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint32_t> pixels;
    std::uint64_t rays = 0;
    /// Milliseconds. trace_ms includes shade_ms where that is 0.
    double deform_ms = 0;
    double update_ms = 0;
    double trace_ms = 0;
    double shade_ms = 0;
    /// The update to this pose, and whether it ran for this image.
    morphray::Update update;
    bool has_update = false;
    TreeOrigin tree;
};

struct TracedImage {
    ImageRequest request;
    /// As many as there are backends, or none if `error` is set.
    std::vector<TracedPane> panes;
    std::vector<morphray::Box> boxes;
    /// Why there is no image.
    std::string error;
};

}  // namespace mray::app
