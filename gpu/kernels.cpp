#include "gpu/kernels.h"

#include <algorithm>
#include <future>

// Generated from shaders/*.comp.
#include "shaders/morphray_kernels.h"

namespace mray::gpu {
namespace {

/// A region without pixels. Its only tile keeps kernels from dividing by 0.
RegionArguments no_region() {
    RegionArguments nothing = {};
    nothing.tile_columns = 1;
    nothing.tile_count = 1;
    return nothing;
}

/// The budget of a query by that of a ray: lavapipe's is lower.
std::uint32_t query_steps(std::uint32_t steps) {
    return steps <= kStepBudget ? std::min(steps, kQueryStepBudget) : steps;
}

}  // namespace

void Kernel::compile(SharedDevice& device) {
    if (pipeline_) return;
    Pipeline& pipeline = device.pipelines.get(device.device, spirv_, {steps_});
    pipeline_.emplace(device.device, pipeline);
}

void Kernel::bind(const Bindings& bindings, std::uint64_t version) {
    if (bound_version_ == version) return;
    pipeline_->bind(bindings);
    bound_version_ = version;
}

#define WORDS(name) \
    { k_##name##_spirv, k_##name##_storage_spirv }

Kernels::Kernels(SharedDevice& device, Context& context, BufferKind kind, std::uint32_t steps)
    : device_(device),
      context_(context),
      primary(WORDS(primary), kind, steps, no_region()),
      rays(WORDS(rays), kind, steps, RaysArguments{}),
      compact(WORDS(compact), kind, steps, no_region()),
      occlusion(WORDS(occlusion), kind, steps, OcclusionArguments{}),
      resume(WORDS(resume), kind, steps, ResumeArguments{}),
      hits(WORDS(hits), kind, query_steps(steps), QueryArguments{}),
      winding(WORDS(winding), kind, query_steps(steps), QueryArguments{}),
      closest(WORDS(closest), kind, query_steps(steps), QueryArguments{}),
      shade(WORDS(shade), kind, steps, no_region()),
      refit_leaves(WORDS(refit_leaves), kind, steps, RefitArguments{}),
      refit_nodes(WORDS(refit_nodes), kind, steps, RefitArguments{}) {}

#undef WORDS

void Kernels::set_bindings(const Bindings& bindings) {
    bindings_ = bindings;
    ++version_;
}

void Kernels::prepare(std::span<Kernel* const> needed, const Watch& watch) {
    std::vector<Kernel*> missing;
    for (Kernel* const kernel : needed) {
        if (kernel->is_ready()) {
            kernel->bind(bindings_, version_);
        } else {
            missing.push_back(kernel);
        }
    }
    if (missing.empty()) return;
    // One more thread compiles the slower half. More would gain little, and keep freed memory.
    const std::span all_missing(missing);
    const std::size_t half = (missing.size() + 1) / 2;
    const auto rest = all_missing.subspan(half);
    const auto compile_rest = [this, rest, watch] {
        for (Kernel* const kernel : rest) {
            watch.throw_if_cancelled();
            kernel->compile(device_);
        }
    };
    // Its destructor waits for the thread, also after an exception. Without one it runs in get().
    const std::launch in_thread = std::launch::async | std::launch::deferred;
    std::future<void> others =
        std::async(rest.empty() ? std::launch::deferred : in_thread, compile_rest);
    for (Kernel* const kernel : all_missing.first(half)) {
        watch.throw_if_cancelled();
        kernel->compile(device_);
        make_ready(*kernel);
    }
    others.get();
    for (Kernel* const kernel : rest) {
        watch.throw_if_cancelled();
        make_ready(*kernel);
    }
}

void Kernels::make_ready(Kernel& kernel) {
    kernel.bind(bindings_, version_);
    if (kernel.is_ready()) return;
    context_.submit("compile a kernel",
                    [&](VkCommandBuffer commands) { kernel.dispatch_nothing(commands); });
    kernel.set_ready();
}

}  // namespace mray::gpu
