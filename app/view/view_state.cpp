#include "app/view/view_state.h"

#include <algorithm>

#include "common/scene/scene_space.h"
#include "morphray/image.hpp"
#include "scenes/inside_view.h"

namespace mray::app {
namespace {

using morphray::Shading;

constexpr std::uint32_t kSamples[] = {1, 4, 16, 64};

/// Hits, occlusion and colour of the two images that a lit image is traced in.
constexpr std::uint64_t kBytesPerSample = 48;

bool has_ao(const ViewState& state) { return state.shading == Shading::lit && state.ao_count > 0; }

}  // namespace

ViewState initial_state(const Options& options, const Clip& clip, BackendChoice backend,
                        double frame) {
    // Refuses impossible views with the messages of render.
    ViewSpec spec = with_inside_view(options.view, clip);
    const ResolvedView view = resolve_view(spec, clip.bounds());
    spec.ao_count = std::max(spec.ao_count, 1u);
    make_image_params(spec, clip.bounds(), SceneSpace(clip.bounds()));
    ViewState state{.playback = Playback(clip.first_frame(), clip.last_frame(), frame),
                    .camera = Camera(view, options.view.up, options.view.fov),
                    .light = view.light};
    state.playback.playing = options.plays;
    state.shading = options.shading.shading.value_or(Shading::lit);
    state.rays = options.view.rays;
    state.flat = options.shading.flat;
    state.scene = {options.tree.policy(), options.shading.ground};
    state.samples = options.shading.samples.value_or(64);
    state.ao_count = options.view.ao_count;
    state.ao_distance = options.view.ao_distance;
    state.backend = backend;
    state.comparison = options.comparison;
    state.width = options.view.width;
    state.height = options.view.height;
    return state;
}

Point light_at_camera(const ViewState& state, const Clip& clip) {
    ViewSpec spec = request_of(state, 0).view;
    spec.light.reset();
    return resolve_view(spec, clip.bounds()).light;
}

int last_step(const ViewState& state) {
    const auto* const found = std::find(std::begin(kSamples), std::end(kSamples), state.samples);
    return static_cast<int>(found - std::begin(kSamples)) + (has_ao(state) ? 1 : 0);
}

ImageRequest request_of(const ViewState& state, int step) {
    ImageRequest request;
    const bool is_fast = step == 0;
    const std::size_t level =
        static_cast<std::size_t>(has_ao(state) ? std::max(step - 1, 0) : step);
    request.frame = state.playback.frame();
    request.view = {.eye = state.camera.eye(),
                    .target = state.camera.target(),
                    .up = state.camera.up(),
                    .fov = state.camera.fov_degrees(),
                    .light = state.light,
                    .width = state.width,
                    .height = state.height,
                    .rays = state.rays,
                    .ao_count = state.ao_count,
                    .ao_distance = state.ao_distance};
    if (state.shading == Shading::lit && is_fast) request.view.ao_count = 0;
    if (state.shading != Shading::lit) request.view.ao_count = std::max(state.ao_count, 1u);
    if (state.comparison == Comparison::kSide) request.view.width = std::max(state.width / 2, 1u);
    request.shading = state.shading;
    request.samples = kSamples[std::min(level, std::size(kSamples) - 1)];
    request.flat = state.flat;
    request.scene = state.scene;
    request.backends = {state.backend};
    if (state.comparison != Comparison::kOff)
        request.backends = {BackendChoice::kCpu, BackendChoice::kVulkan};
    request.box_depth = state.box_depth;
    return request;
}

std::uint32_t affordable_samples(std::uint32_t width, std::uint32_t height, std::uint64_t bytes) {
    std::uint32_t most = 1;
    for (const std::uint32_t samples : kSamples) {
        const std::uint64_t side = morphray::sample_side(samples);
        const std::uint64_t pixels = std::uint64_t{width} * height * samples;
        const bool fits = width * side <= kMaxImageSide && height * side <= kMaxImageSide &&
                          pixels <= kMaxPixels && pixels <= bytes / kBytesPerSample;
        if (fits) most = samples;
    }
    return most;
}

}  // namespace mray::app
