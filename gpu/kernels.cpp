#include "gpu/kernels.h"

#include <algorithm>
#include <future>

// Generated from shaders/*.comp.
#include "shaders/morphray_kernels.h"

namespace mray::gpu {
namespace {

// A region without pixels. Its only tile keeps kernels from dividing by 0.
constexpr RegionArguments kNoRegion = {.tile_columns = 1, .tile_count = 1};

/// The budget of a query by that of a ray: lavapipe's is lower.
std::uint32_t query_steps(std::uint32_t steps) {
    return steps <= kStepBudget ? std::min(steps, kQueryStepBudget) : steps;
}

}  // namespace

#define SPIRV(name) k_##name##_spirv, k_##name##_storage_spirv

Kernels::Kernels(SharedDevice& device, Context& context, std::uint32_t steps)
    : device_(device),
      context_(context),
      primary(SPIRV(primary), {steps}, kNoRegion),
      rays(SPIRV(rays), {steps}, CountArguments{}),
      compact(SPIRV(compact), {steps}, kNoRegion),
      occlusion(SPIRV(occlusion), {steps}, OcclusionArguments{}),
      decide(SPIRV(decide), {steps}, DecideArguments{}),
      resume(SPIRV(resume), {steps}, ResumeArguments{}),
      hits(SPIRV(hits), query_steps(steps)),
      winding(SPIRV(winding), query_steps(steps)),
      closest(SPIRV(closest), query_steps(steps)),
      shade(SPIRV(shade), {steps}, kNoRegion),
      pack_hits(SPIRV(pack_hits), {steps}, PackArguments{}),
      find_surfaces(SPIRV(find_surfaces), {steps}, LitArguments{}),
      flat_shadows(SPIRV(flat_shadows), {steps}, LitArguments{}),
      lit(SPIRV(lit), {steps}, LitArguments{}),
      move_bodies(SPIRV(move_bodies), {steps}, CountArguments{}),
      refit_leaves(SPIRV(refit_leaves), {steps}, RefitArguments{}),
      refit_nodes(SPIRV(refit_nodes), {steps}, RefitArguments{}) {}

#undef SPIRV

void Kernels::prepare(const std::vector<Kernel*>& needed, const Watch& watch) {
    std::vector<Kernel*> missing;
    for (Kernel* const kernel : needed) {
        if (is_compiled(*kernel) && kernel->pipeline_->pipeline().is_warm()) {
            make_ready(*kernel);
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
            compile(*kernel);
        }
    };
    // Its destructor waits for the thread, also after an exception. Without one it runs in get().
    const std::launch in_thread = std::launch::async | std::launch::deferred;
    std::future<void> others =
        std::async(rest.empty() ? std::launch::deferred : in_thread, compile_rest);
    for (Kernel* const kernel : all_missing.first(half)) {
        watch.throw_if_cancelled();
        compile(*kernel);
        make_ready(*kernel);
    }
    others.get();
    for (Kernel* const kernel : rest) {
        watch.throw_if_cancelled();
        make_ready(*kernel);
    }
}

/// Threads may compile different kernels at the same time.
void Kernels::compile(Kernel& kernel) {
    if (is_compiled(kernel)) return;
    Device& device = device_.device;
    const auto spirv = kind_ == BufferKind::kTexels ? kernel.texels_ : kernel.storage_;
    kernel.pipeline_.emplace(device, device_.pipelines.get(device, spirv, kernel.constants_));
    kernel.kind_ = kind_;
}

/// Binds the resources, unless this version of them is bound, and dispatches a new kernel once.
void Kernels::make_ready(Kernel& kernel) {
    BoundPipeline& bound = *kernel.pipeline_;
    if (kernel.bound_version_ != version_) bound.bind(bindings_);
    kernel.bound_version_ = version_;
    if (bound.pipeline().is_warm()) return;
    context_.submit("compile a kernel", [&](VkCommandBuffer commands) {
        bound.dispatch_bytes(commands, kernel.nothing_, 1);
    });
    bound.pipeline().set_warm();
}

}  // namespace mray::gpu
