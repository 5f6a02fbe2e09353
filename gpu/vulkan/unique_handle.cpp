#include "gpu/vulkan/unique_handle.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <vector>

namespace mray::gpu {
namespace {

struct GivenUp {
    std::atomic<bool> is_any = false;
    std::mutex mutex;
    std::vector<VkDevice> devices;
};

/// Never destroyed, since handles of other static objects may end later.
GivenUp& given_up() {
    static GivenUp& all = *new GivenUp;
    return all;
}

}  // namespace

void give_up(VkDevice device) {
    GivenUp& all = given_up();
    const std::scoped_lock lock(all.mutex);
    all.devices.push_back(device);
    all.is_any = true;
}

bool is_given_up(VkDevice device) {
    GivenUp& all = given_up();
    if (!all.is_any) return false;
    const std::scoped_lock lock(all.mutex);
    return std::ranges::find(all.devices, device) != all.devices.end();
}

}  // namespace mray::gpu
