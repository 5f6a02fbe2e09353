// The first usable device, under the validation layer.
#pragma once

#include <memory>

#include "gpu/shared_device.h"

namespace mray::test {

/// A backend whose calls throw if the layer reports an error.
inline std::unique_ptr<Backend> validated_device(const gpu::Tuning& tuning = {}) {
    return gpu::make_vulkan_backend({.device = "", .validate = true}, tuning);
}

}  // namespace mray::test
