#include "app/clip_scene.h"

#include <cstdlib>
#include <utility>

#include "app/backends.h"
#include "app/library_calls.h"
#include "common/base/stopwatch.h"

namespace mray::app {
namespace {

morphray::CpuOptions cpu_options(const BackendOptions& options) {
    return {.threads = options.threads, .simd = options.simd};
}

morphray::Device open_vulkan(const BackendOptions& options) {
    check_vulkan();
    return morphray::Device::vulkan({.device = options.device, .validate = options.validate});
}

morphray::UpdatePolicy policy_of(const TreeOptions& tree) {
    const std::string& text = tree.update;
    if (text == "refit") return morphray::Refit{};
    if (text == "rebuild") return morphray::Rebuild{};
    const std::string_view every = "every:";
    if (text.starts_with(every)) {
        const std::string period = text.substr(every.size());
        return morphray::Every{
            static_cast<std::uint32_t>(std::strtoul(period.c_str(), nullptr, 10))};
    }
    return morphray::Auto{.budget_ms = tree.update_config.budget_ms,
                          .budget = tree.update_config.budget,
                          .deterministic = tree.update_config.deterministic};
}

morphray::View view_of(const ViewSpec& spec) {
    morphray::View view = {.eye = spec.eye,
                           .target = spec.target,
                           .up = spec.up,
                           .fov = spec.fov,
                           .light = spec.light,
                           .width = spec.width,
                           .height = spec.height,
                           .ao_count = spec.ao_count,
                           .ao_distance = spec.ao_distance};
    if (spec.rays == kRaysShadow) view.rays = morphray::Rays::shadow;
    if (spec.rays == kRaysAo) view.rays = morphray::Rays::ao;
    return view;
}

}  // namespace

ErrorKind kind_of(morphray::ErrorCode code) {
    using morphray::ErrorCode;
    switch (code) {
        case ErrorCode::bad_argument:
            return ErrorKind::kBadArgument;
        case ErrorCode::bad_input:
            return ErrorKind::kBadInput;
        case ErrorCode::unavailable:
            return ErrorKind::kUnavailable;
        case ErrorCode::output:
            return ErrorKind::kOutput;
        case ErrorCode::limit:
            return ErrorKind::kLimit;
        case ErrorCode::device_lost:
            return ErrorKind::kDeviceLost;
        default:
            return ErrorKind::kInternal;
    }
}

morphray::Device open_device(const BackendOptions& options, const Messages& messages) {
    return make_chosen(options.choice, options, messages, [&](BackendChoice chosen) {
        return call_library([&] {
            if (chosen == BackendChoice::kVulkan) return open_vulkan(options);
            if (chosen == BackendChoice::kBrute)
                return morphray::Device::brute_force(cpu_options(options));
            return morphray::Device::cpu(cpu_options(options));
        });
    });
}

morphray::MeshView mesh_of(const Topology& topology, const std::vector<vec3>& world) {
    static_assert(sizeof(uvec3) == 3 * sizeof(std::uint32_t));
    const std::span<const uvec3> triangles(topology.triangles);
    return {.positions = morphray::packed(world),
            .triangles = {reinterpret_cast<const std::uint32_t*>(triangles.data()),
                          3 * triangles.size()},
            .albedo = topology.albedo};
}

std::optional<morphray::Box> bounds_of(const Clip& clip) {
    const WorldBounds bounds = clip.bounds();
    if (bounds.empty()) return std::nullopt;
    return morphray::Box{{bounds.lower[0], bounds.lower[1], bounds.lower[2]},
                         {bounds.upper[0], bounds.upper[1], bounds.upper[2]}};
}

ClipScene::ClipScene(const Options& options, const Clip& clip, double first_frame,
                     const Messages& messages)
    : clip_(clip),
      positions_(clip.topology().vertex_count),
      current_(options.tree.build_at.value_or(first_frame)) {
    const morphray::Device device = open_device(options.backend, messages);
    const bool traces_on_vulkan = device.name() == "vulkan";
    refitter_ = traces_on_vulkan ? "vulkan" : "cpu";
    call_library([&] {
        morphray::SceneOptions scene_options = {
            .bounds = bounds_of(clip),
            .update = policy_of(options.tree),
            .split = options.tree.split == SplitMethod::kSweep ? morphray::Split::sweep
                                                               : morphray::Split::binned,
            .record_cost_ratio = options.tree.update_config.record_cost_ratio};
        if (options.tree.refit_on == RefitOn::kVulkan && !traces_on_vulkan) {
            scene_options.refit_on = open_vulkan(options.backend);
            refitter_ = "vulkan";
        }
        if (options.tree.refit_on == RefitOn::kCpu && traces_on_vulkan) {
            scene_options.refit_on = morphray::Device::cpu(cpu_options(options.backend));
            refitter_ = "cpu";
        }
        messages.note("tracing on " + device.name() + ": " + device.description());
        place(current_);
        scene_ =
            morphray::Scene::build(mesh_of(clip.topology(), positions_), device, scene_options);
        update_ = scene_->last_update();
    });
}

void ClipScene::place(double frame) {
    const Stopwatch watch;
    clip_.positions(frame, positions_);
    deform_ms_ = watch.ms();
}

void ClipScene::advance(double frame) {
    if (std::exchange(is_fresh_, false) && frame == current_) return;
    current_ = frame;
    place(frame);
    trace_ms_ = 0;
    rays_ = 0;
    update_ = call_library([&] { return scene_->update(); });
}

morphray::Image ClipScene::render(const ViewSpec& view) {
    return call_library([&] {
        morphray::Image image = scene_->render(view_of(view));
        trace_ms_ = image.trace_ms;
        rays_ = image.ray_count;
        update_ = scene_->last_update();
        return image;
    });
}

FrameTimes ClipScene::times() const {
    return {.deform_ms = deform_ms_ + update_.read_ms,
            .update = {.upload_ms = update_.upload_ms,
                       .refit_ms = update_.refit_ms,
                       .decide_ms = update_.decide_ms,
                       .restructure_ms = update_.restructure_ms,
                       .rebuild_ms = update_.rebuild_ms},
            .trace_ms = trace_ms_,
            .rays = rays_};
}

std::string ClipScene::refitted_on() const {
    const bool was_built =
        update_.step == morphray::Step::build || update_.step == morphray::Step::rebuild;
    return was_built ? std::string() : refitter_;
}

}  // namespace mray::app
