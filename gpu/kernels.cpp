#include "gpu/kernels.h"

#include <algorithm>
#include <cstdint>
#include <future>
#include <iterator>
#include <span>

// Generated from shaders/*.comp; they use std::uint32_t without including it.
#include "shaders/occlusion/occlusion_spirv.h"
#include "shaders/queries/closest_spirv.h"
#include "shaders/queries/hits_spirv.h"
#include "shaders/queries/winding_spirv.h"
#include "shaders/refit/refit_leaves_spirv.h"
#include "shaders/refit/refit_nodes_spirv.h"
#include "shaders/shade/compact_spirv.h"
#include "shaders/shade/shade_spirv.h"
#include "shaders/single_ray/primary_spirv.h"
#include "shaders/single_ray/rays_spirv.h"
#include "shaders/single_ray/resume_spirv.h"

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

Constants single_ray_constants(const Tuning& tuning) {
    static_assert(kConstantStepBudget == 0);
    return {tuning.step_budget};
}

Constants question_constants(const Tuning& tuning) {
    return {std::min(tuning.step_budget, kQuestionStepBudget)};
}

}  // namespace

Kernels::Kernels(Context& context, const Tuning& tuning)
    : context_(context),
      primary("primary", k_primary_spirv, single_ray_constants(tuning), no_region()),
      rays("rays", k_rays_spirv, single_ray_constants(tuning), RaysArguments{}),
      compact("compact", k_compact_spirv, {}, no_region()),
      occlusion("occlusion", k_occlusion_spirv, single_ray_constants(tuning), OcclusionArguments{}),
      resume("resume", k_resume_spirv, single_ray_constants(tuning), ResumeArguments{}),
      hits("hits", k_hits_spirv, question_constants(tuning), QuestionArguments{}),
      winding("winding", k_winding_spirv, question_constants(tuning), QuestionArguments{}),
      closest("closest", k_closest_spirv, question_constants(tuning), QuestionArguments{}),
      shade("shade", k_shade_spirv, {}, no_region()),
      refit_leaves("refit leaves", k_refit_leaves_spirv, {}, RefitArguments{}),
      refit_nodes("refit nodes", k_refit_nodes_spirv, {}, RefitArguments{}) {}

std::array<Kernel*, 11> Kernels::all() {
    return {&primary, &rays,    &compact, &occlusion,    &resume,     &hits,
            &winding, &closest, &shade,   &refit_leaves, &refit_nodes};
}

void Kernels::bind(const Bindings& bindings) {
    bindings_ = bindings;
    for (Kernel* kernel : all()) kernel->bind(bindings);
}

void Kernels::prepare(std::span<Kernel* const> needed, const Watch& watch) {
    std::vector<Kernel*> missing;
    std::ranges::copy_if(needed, std::back_inserter(missing), [this](const Kernel* kernel) {
        return std::ranges::find(ready_, kernel) == ready_.end();
    });
    if (missing.empty()) return;
    // One thread besides this one takes the slower half. More would gain little, and memory that is
    // freed by many short threads stays with the process.
    const std::span all_missing(missing);
    const std::size_t half = (missing.size() + 1) / 2;
    const auto rest = all_missing.subspan(half);
    const auto compile_rest = [this, rest, watch] {
        for (Kernel* const kernel : rest) {
            watch.throw_if_cancelled();
            kernel->compile(context_);
        }
    };
    // Waits for its thread at its end, also after an exception. Without a thread it runs in get().
    const std::launch in_thread = std::launch::async | std::launch::deferred;
    std::future<void> others =
        std::async(rest.empty() ? std::launch::deferred : in_thread, compile_rest);
    for (Kernel* const kernel : all_missing.first(half)) {
        watch.throw_if_cancelled();
        kernel->compile(context_);
        make_ready(*kernel);
    }
    others.get();
    for (Kernel* const kernel : rest) {
        watch.throw_if_cancelled();
        make_ready(*kernel);
    }
}

void Kernels::make_ready(Kernel& kernel) {
    kernel.bind(bindings_);
    context_.submit("compile a kernel",
                    [&](VkCommandBuffer commands) { kernel.dispatch_nothing(commands); });
    ready_.push_back(&kernel);
}

}  // namespace mray::gpu
