#include "gpu/kernel.h"

namespace mray::gpu {

void Kernel::compile(Context& context) {
    if (!pipeline_) pipeline_.emplace(context, name_, spirv_, constants_);
}

void Kernel::bind(const Bindings& bindings) {
    if (pipeline_) pipeline_->bind(bindings);
}

}  // namespace mray::gpu
