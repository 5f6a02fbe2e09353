// The state of the viewer: plain data that input changes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/view/camera.h"
#include "app/view/image_request.h"
#include "app/view/playback.h"
#include "scenes/clip.h"

namespace mray::app {

struct ViewState {
    Playback playback;
    Camera camera;
    Point light = {};

    morphray::Shading shading = morphray::Shading::lit;
    /// kRaysPrimary, ...: for Shading::plain.
    std::uint32_t rays = kRaysPrimary;
    bool flat = false;
    SceneSettings scene = {};
    /// Samples and ambient-occlusion rays of a still image.
    std::uint32_t samples = 64;
    std::uint32_t ao_count = 8;
    double ao_distance = 0;

    BackendChoice backend = BackendChoice::kCpu;
    /// With any but kOff the CPU's image and Vulkan's.
    Comparison comparison = Comparison::kOff;
    /// The part of the width that shows the CPU's image.
    float wipe = 0.5f;
    int box_depth = -1;

    std::uint32_t width = 1280;
    std::uint32_t height = 720;
};

/// The state at the start. The options are those of with_render_defaults(), and `backend` is what
/// options.backend.choice means here. Throws Error for an impossible view.
ViewState initial_state(const Options& options, const Clip& clip, BackendChoice backend,
                        double frame);

/// The default light for where the camera is.
Point light_at_camera(const ViewState& state, const Clip& clip);

/// The steps from a first, fast image to the one that is wanted, 0 being the first: a sample
/// without ambient occlusion, a sample, and 4, 16 and 64 samples as far as ViewState::samples goes.
int last_step(const ViewState& state);

/// The image to trace at a step.
ImageRequest request_of(const ViewState& state, int step);

/// The most samples a pixel that an image of this size can have in `bytes` of memory.
std::uint32_t affordable_samples(std::uint32_t width, std::uint32_t height, std::uint64_t bytes);

}  // namespace mray::app
