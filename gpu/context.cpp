#include "gpu/context.h"

#include <algorithm>
#include <chrono>

#include "gpu/result.h"

namespace morphray::gpu {
namespace {

using Clock = std::chrono::steady_clock;

PhysicalDevice pick(const Instance& instance, const std::string& wanted) {
    std::vector<PhysicalDevice> devices = physical_devices(instance);
    std::vector<DeviceInfo> infos;
    for (const PhysicalDevice& d : devices) infos.push_back(d.info);
    return devices[choose_device(infos, wanted)];
}

VkDevice create_device(const PhysicalDevice& physical) {
    const float priority = 1.0f;
    const VkDeviceQueueCreateInfo queue = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
        .queueFamilyIndex = physical.queue_family,
        .queueCount = 1,
        .pQueuePriorities = &priority,
    };
    const char* const float_controls = VK_KHR_SHADER_FLOAT_CONTROLS_EXTENSION_NAME;
    const VkDeviceCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
        .queueCreateInfoCount = 1,
        .pQueueCreateInfos = &queue,
        .enabledExtensionCount = physical.float_controls_is_extension ? 1u : 0u,
        .ppEnabledExtensionNames = &float_controls,
    };
    VkDevice device = VK_NULL_HANDLE;
    check(vkCreateDevice(physical.handle, &info, nullptr, &device), "create the device");
    return device;
}

UniqueCommandPool create_pool(VkDevice device, std::uint32_t family) {
    const VkCommandPoolCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
        .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
        .queueFamilyIndex = family,
    };
    VkCommandPool pool = VK_NULL_HANDLE;
    check(vkCreateCommandPool(device, &info, nullptr, &pool), "create a command pool");
    return {device, pool};
}

VkCommandBuffer allocate_commands(VkDevice device, VkCommandPool pool) {
    const VkCommandBufferAllocateInfo info = {
        .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .commandPool = pool,
        .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
        .commandBufferCount = 1,
    };
    VkCommandBuffer commands = VK_NULL_HANDLE;
    check(vkAllocateCommandBuffers(device, &info, &commands), "allocate a command buffer");
    return commands;
}

UniqueFence create_fence(VkDevice device) {
    const VkFenceCreateInfo info = {.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO};
    VkFence fence = VK_NULL_HANDLE;
    check(vkCreateFence(device, &info, nullptr, &fence), "create a fence");
    return {device, fence};
}

UniqueQueryPool create_queries(VkDevice device, std::uint32_t timestamp_bits) {
    if (timestamp_bits == 0) return {};
    const VkQueryPoolCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
        .queryType = VK_QUERY_TYPE_TIMESTAMP,
        .queryCount = 2,
    };
    VkQueryPool pool = VK_NULL_HANDLE;
    check(vkCreateQueryPool(device, &info, nullptr, &pool), "create a query pool");
    return {device, pool};
}

double ms_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

}  // namespace

Context::Context(const VulkanConfig& config, const Tuning& tuning)
    : tuning_(tuning),
      log_(tuning.log != nullptr ? *tuning.log : own_log_),
      instance_(config.validate, tuning.loader, log_),
      physical_(pick(instance_, config.device)),
      device_(create_device(physical_)),
      pool_(create_pool(device(), physical_.queue_family)),
      commands_(allocate_commands(device(), pool_.get())),
      fence_(create_fence(device())),
      queries_(create_queries(device(), physical_.timestamp_bits)) {
    vkGetDeviceQueue(device(), physical_.queue_family, 0, &queue_);
    name(VK_OBJECT_TYPE_QUEUE, queue_, "compute");
    name(VK_OBJECT_TYPE_COMMAND_BUFFER, commands_, "commands");
    throw_on_validation_errors();
}

double Context::submit(const char* what, const std::function<void(VkCommandBuffer)>& record) {
    check(vkResetCommandPool(device(), pool_.get(), 0), "reset the command pool");
    const VkCommandBufferBeginInfo begin = {
        .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
        .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT,
    };
    check(vkBeginCommandBuffer(commands_, &begin), "begin a command buffer");
    const bool has_timestamps = queries_.get() != VK_NULL_HANDLE;
    constexpr VkPipelineStageFlags kWork =
        VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    constexpr VkAccessFlags kWrites = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
    constexpr VkAccessFlags kReads = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT;
    // Writer: kernels and copies of earlier submissions; reader: those of this one. The host has
    // waited for them, which makes their writes available but not visible to the device.
    barrier(commands_, kWork, kWrites, kWork, kReads | kWrites);
    if (has_timestamps) {
        vkCmdResetQueryPool(commands_, queries_.get(), 0, 2);
        vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, queries_.get(), 0);
    }
    record(commands_);
    if (has_timestamps) {
        vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_.get(), 1);
    }
    // Writer: kernels and copies of this submission; reader: the host, after the fence.
    barrier(commands_, kWork, kWrites, VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT);
    check(vkEndCommandBuffer(commands_), "end a command buffer");

    const VkFence fence = fence_.get();
    check(vkResetFences(device(), 1, &fence), "reset a fence");
    const VkSubmitInfo info = {
        .sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
        .commandBufferCount = 1,
        .pCommandBuffers = &commands_,
    };
    const Clock::time_point start = Clock::now();
    check(vkQueueSubmit(queue_, 1, &info, fence), "submit work");
    wait(what);
    const double wall_ms = ms_since(start);
    throw_on_validation_errors();
    return has_timestamps ? device_ms() : wall_ms;
}

void Context::wait(const char* what) {
    constexpr std::uint64_t kSliceMs = 1000;
    const VkFence fence = fence_.get();
    std::uint64_t left_ms = tuning_.submit_timeout_ms;
    VkResult result = VK_TIMEOUT;
    do {
        const std::uint64_t slice_ms = std::min(left_ms, kSliceMs);
        result = vkWaitForFences(device(), 1, &fence, VK_TRUE, slice_ms * 1'000'000);
        left_ms -= slice_ms;
    } while (result == VK_TIMEOUT && left_ms > 0);
    if (result == VK_SUCCESS) return;
    // What the device may still be writing to is destroyed by whoever catches the error, so wait
    // for it: a device that hangs is reset by its driver within seconds.
    vkDeviceWaitIdle(device());
    if (result == VK_TIMEOUT) {
        throw Error(ExitCode::kDeviceLost, "Vulkan: the device did not finish to " +
                                               std::string(what) + " within " +
                                               std::to_string(tuning_.submit_timeout_ms) + " ms");
    }
    throw_result(result, what);
}

double Context::device_ms() const {
    std::uint64_t ticks[2] = {};
    check(vkGetQueryPoolResults(device(), queries_.get(), 0, 2, sizeof(ticks), ticks,
                                sizeof(ticks[0]), VK_QUERY_RESULT_64_BIT),
          "read timestamps");
    const std::uint32_t bits = physical_.timestamp_bits;
    const std::uint64_t mask = bits >= 64 ? ~0ull : (1ull << bits) - 1;
    const std::uint64_t elapsed = (ticks[1] - ticks[0]) & mask;
    return static_cast<double>(elapsed) * static_cast<double>(limits().timestampPeriod) * 1e-6;
}

void Context::name_object(VkObjectType type, std::uint64_t handle, const std::string& text) {
    if (!instance_.has_debug_utils()) return;
    const VkDebugUtilsObjectNameInfoEXT info = {
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT,
        .objectType = type,
        .objectHandle = handle,
        .pObjectName = text.c_str(),
    };
    check(vkSetDebugUtilsObjectNameEXT(device(), &info), "name an object");
}

void barrier(VkCommandBuffer commands, VkPipelineStageFlags from_stage, VkAccessFlags from,
             VkPipelineStageFlags to_stage, VkAccessFlags to) {
    const VkMemoryBarrier memory = {
        .sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
        .srcAccessMask = from,
        .dstAccessMask = to,
    };
    vkCmdPipelineBarrier(commands, from_stage, to_stage, 0, 1, &memory, 0, nullptr, 0, nullptr);
}

}  // namespace morphray::gpu
