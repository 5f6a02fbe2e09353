#include "gpu/vulkan/lavapipe.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <cstdlib>

namespace mray::gpu {

bool has_unsound_width(const VkPhysicalDeviceDriverProperties& driver,
                       std::uint32_t subgroup_size) {
    // Lavapipe's number of a version is always 1.
    unsigned mesa = 0;
    return driver.driverID == VK_DRIVER_ID_MESA_LLVMPIPE && subgroup_size != 8 &&
           std::getenv("LP_NATIVE_VECTOR_WIDTH") != nullptr &&
           std::sscanf(driver.driverInfo, "Mesa %u", &mesa) == 1 && mesa > 22;
}

VkDeviceSize padded_size(VkDeviceSize size) {
    const VkDeviceSize rounded = std::max<VkDeviceSize>((size + 15) / 16 * 16, 48);
    return std::has_single_bit(rounded) ? rounded + 16 : rounded;
}

}  // namespace mray::gpu
