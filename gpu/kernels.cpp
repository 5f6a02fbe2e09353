#include "gpu/kernels.h"

#include <algorithm>
#include <cstdint>
#include <future>
#include <span>
#include <vector>

// Generated from shaders/*.comp; they use std::uint32_t without including it.
#include "shaders/occlusion/occlusion_spirv.h"
#include "shaders/occlusion/occlusion_storage_spirv.h"
#include "shaders/queries/closest_spirv.h"
#include "shaders/queries/closest_storage_spirv.h"
#include "shaders/queries/hits_spirv.h"
#include "shaders/queries/hits_storage_spirv.h"
#include "shaders/queries/winding_spirv.h"
#include "shaders/queries/winding_storage_spirv.h"
#include "shaders/refit/refit_leaves_spirv.h"
#include "shaders/refit/refit_leaves_storage_spirv.h"
#include "shaders/refit/refit_nodes_spirv.h"
#include "shaders/refit/refit_nodes_storage_spirv.h"
#include "shaders/shade/compact_spirv.h"
#include "shaders/shade/compact_storage_spirv.h"
#include "shaders/shade/shade_spirv.h"
#include "shaders/shade/shade_storage_spirv.h"
#include "shaders/single_ray/primary_spirv.h"
#include "shaders/single_ray/primary_storage_spirv.h"
#include "shaders/single_ray/rays_spirv.h"
#include "shaders/single_ray/rays_storage_spirv.h"
#include "shaders/single_ray/resume_spirv.h"
#include "shaders/single_ray/resume_storage_spirv.h"

namespace mray::gpu {
namespace {

using Constants = std::vector<std::uint32_t>;

/// A region without pixels. Its only tile keeps kernels from dividing by 0.
RegionArguments no_region() {
    RegionArguments nothing = {};
    nothing.tile_columns = 1;
    nothing.tile_count = 1;
    return nothing;
}

Constants ray_constants(const PhysicalDevice& device, const Tuning& tuning) {
    static_assert(kConstantStepBudget == 0 && kConstantBoxes == 1);
    return {step_budget(device, tuning), tuning.boxes};
}

Constants query_constants(const PhysicalDevice& device, const Tuning& tuning) {
    const std::uint32_t steps = step_budget(device, tuning);
    return {steps <= kStepBudget ? std::min(steps, kQueryStepBudget) : steps};
}

}  // namespace

void Kernel::compile(SharedDevice& device) {
    if (pipeline_) return;
    Pipeline& pipeline = device.pipelines.get(device.device, name_, spirv_, constants_);
    pipeline_.emplace(device.device, pipeline);
}

void Kernel::bind(const Bindings& bindings, std::uint64_t version) {
    if (bound_version_ == version) return;
    pipeline_->bind(bindings);
    bound_version_ = version;
}

/// The words of kernel `name`.
#define WORDS(name) \
    { k_##name##_spirv, k_##name##_storage_spirv }

Kernels::Kernels(SharedDevice& device, Context& context, const Tuning& tuning)
    : Kernels(device, context, buffer_kind(device.device.physical(), tuning),
              ray_constants(device.device.physical(), tuning),
              query_constants(device.device.physical(), tuning)) {}

Kernels::Kernels(SharedDevice& device, Context& context, BufferKind kind, const Constants& of_rays,
                 const Constants& of_queries)
    : device_(device),
      context_(context),
      primary("primary", WORDS(primary), kind, of_rays, no_region()),
      rays("rays", WORDS(rays), kind, of_rays, RaysArguments{}),
      compact("compact", WORDS(compact), kind, {}, no_region()),
      occlusion("occlusion", WORDS(occlusion), kind, of_rays, OcclusionArguments{}),
      resume("resume", WORDS(resume), kind, of_rays, ResumeArguments{}),
      hits("hits", WORDS(hits), kind, of_queries, QueryArguments{}),
      winding("winding", WORDS(winding), kind, of_queries, QueryArguments{}),
      closest("closest", WORDS(closest), kind, of_queries, QueryArguments{}),
      shade("shade", WORDS(shade), kind, {}, no_region()),
      refit_leaves("refit leaves", WORDS(refit_leaves), kind, {}, RefitArguments{}),
      refit_nodes("refit nodes", WORDS(refit_nodes), kind, {}, RefitArguments{}) {}

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
    // One thread besides this one takes the slower half. More would gain little, and memory that is
    // freed by many short threads stays with the process.
    const std::span all_missing(missing);
    const std::size_t half = (missing.size() + 1) / 2;
    const auto rest = all_missing.subspan(half);
    const auto compile_rest = [this, rest, watch] {
        for (Kernel* const kernel : rest) {
            watch.throw_if_cancelled();
            kernel->compile(device_);
        }
    };
    // Waits for its thread at its end, also after an exception. Without a thread it runs in get().
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
