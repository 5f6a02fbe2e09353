// All kernels of the backend.
#pragma once

#include "gpu/pipeline.h"

namespace morphray::gpu {

struct Kernels {
    explicit Kernels(Context& context, std::uint32_t step_budget);

    /// No work may be under way.
    void bind(const Bindings& bindings);

    Pipeline primary;
    Pipeline rays;
    Pipeline occlusion;
    Pipeline resume;
    Pipeline shade;
    Pipeline refit_leaves;
    Pipeline refit_nodes;
};

}  // namespace morphray::gpu
