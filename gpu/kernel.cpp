#include "gpu/kernel.h"

namespace mray::gpu {

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

}  // namespace mray::gpu
