#include "app/backends.h"

#include <fmt/format.h>

#include <utility>

#include "app/memory_budget.h"
#include "common/base/errors.h"
#include "cpu/cpu_backend.h"

namespace mray::app {
namespace {

std::unique_ptr<Backend> make_vulkan([[maybe_unused]] const BackendOptions& options) {
#ifdef MORPHRAY_HAS_VULKAN
    require_driver_memory();
    return gpu::make_vulkan_backend({.device = options.device, .validate = options.validate});
#else
    throw Error(ErrorKind::kUnavailable,
                "Vulkan: not built in; use --backend cpu, or build with -DMORPHRAY_VULKAN=ON");
#endif
}

/// Whether the error means that this machine or build has no usable Vulkan.
bool is_lack_of_vulkan(const Error& error) {
    return error.kind() == ErrorKind::kUnavailable || error.kind() == ErrorKind::kLimit;
}

/// Whether an option requires Vulkan.
bool asks_for_vulkan(const BackendOptions& options) {
    return !options.device.empty() || options.validate;
}

/// Vulkan, or null after a warning if it is unavailable and no option requires it.
std::unique_ptr<Backend> try_vulkan(const BackendOptions& options, const Messages& messages) {
    if (asks_for_vulkan(options)) return make_vulkan(options);
    try {
        return make_vulkan(options);
    } catch (const Error& error) {
        if (!is_lack_of_vulkan(error)) throw;
        messages.warn({{}, fmt::format("{}; using the CPU instead", error.what())});
        return nullptr;
    }
}

/// Whether the only usable Vulkan devices run on the CPU, where the CPU backend is faster.
bool has_only_software_devices() {
    bool any = false;
    try {
        require_driver_memory();
        for (const gpu::DeviceInfo& device : vulkan_devices()) {
            if (!device.unusable.empty()) continue;
            if (device.type != "cpu") return false;
            any = true;
        }
    } catch (const Error& error) {
        // try_vulkan() warns of the reason.
        if (!is_lack_of_vulkan(error)) throw;
    }
    return any;
}

}  // namespace

std::vector<gpu::DeviceInfo> vulkan_devices() {
#ifdef MORPHRAY_HAS_VULKAN
    return gpu::list_devices();
#else
    throw Error(ErrorKind::kUnavailable, "Vulkan: not built in; build with -DMORPHRAY_VULKAN=ON");
#endif
}

std::unique_ptr<Backend> make_backend(const BackendOptions& options, const Messages& messages) {
    return make_backend(options.choice, options, messages);
}

std::unique_ptr<Backend> make_backend(BackendChoice choice, const BackendOptions& options,
                                      const Messages& messages) {
    const cpu::CpuConfig cpu_config{.threads = options.threads, .simd = options.simd};
    if (choice == BackendChoice::kCpu) return cpu::make_cpu_backend(cpu_config);
    if (choice == BackendChoice::kBrute) return cpu::make_brute_backend(cpu_config);
    if (choice == BackendChoice::kVulkan) return make_vulkan(options);
    if (!asks_for_vulkan(options) && has_only_software_devices()) {
        messages.note("no GPU; --backend vulkan takes the device that runs on the CPU");
        return cpu::make_cpu_backend(cpu_config);
    }
    std::unique_ptr<Backend> vulkan = try_vulkan(options, messages);
    return vulkan != nullptr ? std::move(vulkan) : cpu::make_cpu_backend(cpu_config);
}

SessionConfig session_config(const Options& options) {
    return {.update = options.tree.update,
            .update_config = options.tree.update_config,
            .split = options.tree.split,
            .threads = options.backend.threads,
            .build_at = options.tree.build_at};
}

Session open_session(const Options& options, SceneFrames& frames, double first_frame,
                     const Messages& messages) {
    std::unique_ptr<Backend> tracer = make_backend(options.backend, messages);
    std::unique_ptr<Backend> refitter;
    const bool traces_on_vulkan = tracer->name() == "vulkan";
    if (options.tree.refit_on == RefitOn::kVulkan && !traces_on_vulkan) {
        refitter = make_backend(BackendChoice::kVulkan, options.backend, messages);
    }
    if (options.tree.refit_on == RefitOn::kCpu && traces_on_vulkan) {
        refitter = make_backend(BackendChoice::kCpu, options.backend, messages);
    }
    messages.note("tracing on " + tracer->name() + ": " + tracer->description());
    return Session(frames, session_config(options), first_frame, std::move(tracer),
                   std::move(refitter));
}

std::vector<BackendChoice> profiled_backends(const Options& options, const Messages& messages) {
    if (options.backend.choice != BackendChoice::kAuto) return {options.backend.choice};
    if (try_vulkan(options.backend, messages) == nullptr) return {BackendChoice::kCpu};
    return {BackendChoice::kCpu, BackendChoice::kVulkan};
}

}  // namespace mray::app
