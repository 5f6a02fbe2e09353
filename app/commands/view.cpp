// morphray view: a window that shows a scene move.
#include "app/backends/backends.h"
#include "app/base/memory_budget.h"
#include "app/clip/clip_scene.h"
#include "app/clip/frames.h"
#include "app/clip/render_command.h"
#include "app/commands/commands.h"
#include "app/view/window/viewer.h"
#include "common/base/output_file.h"

namespace mray::app {
namespace {

/// Resolves options.backend.choice: kAuto needs a look at the devices.
BackendChoice chosen_backend(const Options& options, const Messages& messages) {
    if (options.comparison != Comparison::kOff) return BackendChoice::kCpu;
    const morphray::Device device = open_device(options.backend, messages);
    if (device.name() == "vulkan") return BackendChoice::kVulkan;
    return device.name() == "brute" ? BackendChoice::kBrute : BackendChoice::kCpu;
}

}  // namespace

ExitCode run_view(const Options& given, const Messages& messages) {
    Options options = with_render_defaults(given);
    // A still image goes on to be refined; a screenshot is what render writes.
    if (given.screenshot.empty()) options.shading.samples = given.shading.samples.value_or(64);
    if (!options.screenshot.empty()) check_writable(options.screenshot);
    const std::unique_ptr<Clip> clip = open_clip(options, messages);
    const double frame = select_frame(options, *clip);
    warn_of_damage(options, *clip, {&frame, 1}, messages);
    require_memory({.triangles = clip->topology().triangles.size(),
                    .vertices = clip->topology().vertex_count,
                    .copies = options.comparison == Comparison::kOff ? 1u : 2u,
                    .pixels = std::uint64_t{options.view.width} * options.view.height,
                    .devices = named_devices(options)},
                   options.scene);
    const ViewState state = initial_state(options, *clip, chosen_backend(options, messages), frame);
    Viewer viewer(options, *clip, messages, state);
    viewer.run();
    if (options.exit_after > 0) messages.print(viewer.summary());
    return ExitCode::kOk;
}

}  // namespace mray::app
