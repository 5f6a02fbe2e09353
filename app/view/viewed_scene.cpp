#include "app/view/viewed_scene.h"

#include <fmt/format.h>

#include <utility>

#include "app/backends/backends.h"
#include "app/base/numbers.h"
#include "app/clip/clip_scene.h"
#include "app/clip/frames.h"

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

ViewedScene::ViewedScene(const Options& given, std::unique_ptr<Clip> opened, const ViewState& first,
                         const Messages& messages, std::function<void()> on_result)
    : options(given),
      clip(std::move(opened)),
      first_state(first),
      engine(options, *clip, messages, std::move(on_result)) {}

std::unique_ptr<ViewedScene> open_viewed_scene(const Options& options, const Messages& messages,
                                               std::function<void()> on_result) {
    std::unique_ptr<Clip> clip = open_clip(options, messages);
    const double frame = select_frame(options, *clip);
    const ViewState state = initial_state(options, *clip, chosen_backend(options, messages), frame);
    return std::make_unique<ViewedScene>(options, std::move(clip), state, messages,
                                         std::move(on_result));
}

std::string building_text(const Clip& clip) {
    return fmt::format("building the tree, {} triangles",
                       brief_count(static_cast<double>(clip.topology().triangles.size())));
}

}  // namespace mray::app
