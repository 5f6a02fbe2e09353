// The compiled kernels of the backend.
#pragma once

#include <cstdint>
#include <span>

#include "shaders/kernel_interface.h"
#include "shaders/morphray_kernels.h"

namespace mray::test {

struct Kernel {
    const char* name;
    std::span<const std::uint32_t> words;
};

#define KERNEL(name) {#name, k_##name##_spirv},
inline const Kernel kKernels[] = {MORPHRAY_KERNELS(KERNEL)};
#undef KERNEL

}  // namespace mray::test
