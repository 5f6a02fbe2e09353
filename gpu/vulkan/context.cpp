#include "gpu/vulkan/context.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <numeric>

#include "common/frame_times.h"

namespace mray::gpu {
namespace {

constexpr VkDeviceSize kStagingBytes = VkDeviceSize{8} << 20;

// The start, the deferred work, and the stages.
constexpr std::uint32_t kStampCount = Context::kMostStages + 2;
constexpr VkPipelineStageFlags kWork =
    VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
constexpr VkAccessFlags kWrites = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;

void barrier_before(VkCommandBuffer commands, VkPipelineStageFlags stage, VkAccessFlags access) {
    const VkMemoryBarrier memory = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
                                    .srcAccessMask = kWrites,
                                    .dstAccessMask = access};
    vkCmdPipelineBarrier(commands, kWork, stage, 0, 1, &memory, 0, nullptr, 0, nullptr);
}

}  // namespace

Context::Context(Device& device, std::uint64_t timeout_ms)
    : device_(device),
      timeout_ms_(timeout_ms),
      pool_(device.get(), vkCreateCommandPool,
            VkCommandPoolCreateInfo{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                    .flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT,
                                    .queueFamilyIndex = physical().queue_family},
            "create a command pool"),
      fence_(device.get(), vkCreateFence,
             VkFenceCreateInfo{.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO}, "create a fence") {
    const VkCommandBufferAllocateInfo commands = {
        .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .commandPool = pool_.get(),
        .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
        .commandBufferCount = 1};
    check(vkAllocateCommandBuffers(device.get(), &commands, &commands_),
          "allocate a command buffer");
    if (physical().timestamp_bits != 0) {
        const VkQueryPoolCreateInfo queries = {.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                                               .queryType = VK_QUERY_TYPE_TIMESTAMP,
                                               .queryCount = kStampCount};
        queries_ = {device.get(), vkCreateQueryPool, queries, "create a query pool"};
    }
    device_.throw_on_validation_errors();
}

void Context::record_all(const Record& record, const Deferred* deferred) {
    check(vkResetCommandPool(device_.get(), pool_.get(), 0), "reset the command pool");
    const VkCommandBufferBeginInfo info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO,
                                           .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT};
    check(vkBeginCommandBuffer(commands_, &info), "begin a command buffer");
    // Writer: kernels and copies of earlier submissions; reader: kernels and copies of this one.
    // The fence has made the writes available, but not visible to the device.
    barrier(commands_);
    if (queries_.get() != VK_NULL_HANDLE) {
        vkCmdResetQueryPool(commands_, queries_.get(), 0, kStampCount);
        vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, queries_.get(), 0);
    }
    stamp_count_ = 1;
    if (deferred != nullptr) {
        deferred->record(commands_);
        // Writer: the deferred work; reader: the rest.
        barrier(commands_);
        stamp(commands_);
    }
    record(commands_);
    stamp(commands_);
    // Writer: kernels and copies of this submission; reader: the host, after the fence.
    barrier_before(commands_, VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT);
    check(vkEndCommandBuffer(commands_), "end a command buffer");
}

void Context::stamp(VkCommandBuffer commands) {
    assert(stamp_count_ < kStampCount);
    if (queries_.get() != VK_NULL_HANDLE) {
        vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_.get(),
                            stamp_count_);
    }
    ++stamp_count_;
}

std::vector<double> Context::submit_stages(const char* what, const Record& record) {
    const std::optional<Deferred> deferred = std::exchange(deferred_, std::nullopt);
    record_all(record, deferred ? &*deferred : nullptr);
    const Stopwatch watch;
    const VkFence fence = fence_.get();
    check(vkResetFences(device_.get(), 1, &fence), "reset a fence");
    const VkSubmitInfo submission = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                                     .commandBufferCount = 1,
                                     .pCommandBuffers = &commands_};
    device_.submit(submission, fence);
    wait(what);
    std::vector<double> stages = stage_ms(watch.ms());
    device_.throw_on_validation_errors();
    if (deferred) {
        deferred->done(stages.front());
        stages.erase(stages.begin());
    }
    return stages;
}

double Context::submit(const char* what, const Record& record) {
    const std::vector<double> stages = submit_stages(what, record);
    return std::accumulate(stages.begin(), stages.end(), 0.0);
}

void Context::defer(Record record, std::function<void(double)> done) {
    assert(!has_deferred());
    deferred_ = {std::move(record), std::move(done)};
}

void Context::wait(const char* what) {
    const VkFence fence = fence_.get();
    const VkResult result =
        vkWaitForFences(device_.get(), 1, &fence, VK_TRUE, timeout_ms_ * 1'000'000);
    if (result == VK_SUCCESS) return;
    if (result != VK_TIMEOUT) {
        if (result == VK_ERROR_DEVICE_LOST) device_.set_lost();
        // The caller frees what the work uses.
        device_.finish();
        throw_result(result, what);
    }
    // The work may go on, so nothing that it uses may be destroyed.
    device_.give_up();
    throw Error(ErrorKind::kDeviceLost, "Vulkan: the device did not finish to " +
                                            std::string(what) + " within " +
                                            std::to_string(timeout_ms_) + " ms");
}

std::vector<double> Context::stage_ms(double wall_ms) const {
    std::vector<double> stages(stamp_count_ - 1);
    if (queries_.get() == VK_NULL_HANDLE) {
        stages.back() = wall_ms;
        return stages;
    }
    std::uint64_t ticks[kStampCount] = {};
    check(vkGetQueryPoolResults(device_.get(), queries_.get(), 0, stamp_count_, sizeof(ticks),
                                ticks, sizeof(ticks[0]), VK_QUERY_RESULT_64_BIT),
          "read timestamps");
    const std::uint32_t bits = physical().timestamp_bits;
    const std::uint64_t mask = bits >= 64 ? ~0ull : (1ull << bits) - 1;
    for (std::size_t i = 0; i < stages.size(); ++i) {
        const std::uint64_t elapsed = (ticks[i + 1] - ticks[i]) & mask;
        stages[i] = static_cast<double>(elapsed) *
                    static_cast<double>(physical().limits.timestampPeriod) * 1e-6;
    }
    return stages;
}

void barrier(VkCommandBuffer commands) {
    barrier_before(commands, kWork,
                   kWrites | VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_TRANSFER_READ_BIT);
}

void Transfer::upload(std::span<const std::byte> bytes, const Buffer& to) {
    assert(bytes.size() <= to.size());
    if (bytes.empty()) return;
    if (!to.mapped().empty()) {
        std::memcpy(to.mapped().data(), bytes.data(), bytes.size());
        return;
    }
    for (std::size_t at = 0; at < bytes.size(); at += kStagingBytes) {
        const std::size_t size = std::min<std::size_t>(bytes.size() - at, kStagingBytes);
        std::memcpy(staging().mapped().data(), bytes.data() + at, size);
        copy(staging(), to, {.srcOffset = 0, .dstOffset = at, .size = size});
    }
}

void Transfer::download(const Buffer& from, std::span<std::byte> bytes) {
    assert(bytes.size() <= from.size());
    if (bytes.empty()) return;
    if (!from.mapped().empty()) {
        std::memcpy(bytes.data(), from.mapped().data(), bytes.size());
        return;
    }
    for (std::size_t at = 0; at < bytes.size(); at += kStagingBytes) {
        const std::size_t size = std::min<std::size_t>(bytes.size() - at, kStagingBytes);
        copy(from, staging(), {.srcOffset = at, .dstOffset = 0, .size = size});
        std::memcpy(bytes.data() + at, staging().mapped().data(), size);
    }
}

void Transfer::run(const Record& copy) {
    if (copy) context_.submit("copy", copy);
}

void Transfer::copy(const Buffer& from, const Buffer& to, const VkBufferCopy& range) {
    run([&](VkCommandBuffer commands) {
        vkCmdCopyBuffer(commands, from.get(), to.get(), 1, &range);
    });
}

const Buffer& Transfer::staging() {
    if (staging_.get() == VK_NULL_HANDLE)
        staging_ = Buffer(context_.device(), "staging", kStagingBytes, 0, Memory::kHost);
    return staging_;
}

}  // namespace mray::gpu
