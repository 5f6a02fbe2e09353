// Work of one backend, submitted to a device one batch at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gpu/vulkan/device.h"
#include "gpu/vulkan/unique_handle.h"

namespace mray::gpu {

using Record = std::function<void(VkCommandBuffer)>;

class Context {
public:
    /// A submission that takes longer than `timeout_ms` counts as a lost device.
    Context(Device& device, std::uint64_t timeout_ms);

    Device& device() { return device_; }
    const PhysicalDevice& physical() const { return device_.physical(); }
    const VkPhysicalDeviceLimits& limits() const { return device_.limits(); }

    /// Records, submits and waits; deferred work goes first. The commands see all writes of earlier
    /// submissions, and the host sees the writes of the commands. Returns the milliseconds that the
    /// stages of `record` took on the device: from its start to the first stamp(), to the next, to
    /// its end. (On a device without timestamps the last one is all of the wait.) `what` is for
    /// errors, a verb with its object. Throws Error(kDeviceLost) if the device is lost or does not
    /// finish in time (it is then given up), and Error(kInternal) if the validation layer reported
    /// an error.
    std::vector<double> submit_stages(const char* what, const Record& record);
    /// submit_stages(); returns the milliseconds of all stages together.
    double submit(const char* what, const Record& record);
    /// Ends a stage of the commands that are being recorded; there can be kMostStages.
    void stamp(VkCommandBuffer commands);
    /// An image takes the most: camera rays, shadow rays, shading.
    static constexpr std::uint32_t kMostStages = 3;

    /// Leaves work to the next submission, one piece at most; after it, `done` is called with the
    /// milliseconds that the work took. If that submission fails, the work is dropped.
    void defer(Record record, std::function<void(double)> done);
    bool has_deferred() const { return deferred_.has_value(); }
    void drop_deferred() { deferred_.reset(); }

private:
    struct DeferredWork {
        Record record;
        std::function<void(double)> done;
    };

    void record_all(const Record& record, const DeferredWork* deferred);
    void submit_commands();
    void wait(const char* what);
    std::vector<double> stage_ms(double wall_ms) const;

    Device& device_;
    std::uint64_t timeout_ms_;
    UniqueCommandPool pool_;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    UniqueFence fence_;
    UniqueQueryPool queries_;
    std::optional<DeferredWork> deferred_;
    std::uint32_t stamp_count_ = 0;
};

/// Makes kernels and copies after it wait for those before it, and see their writes.
void barrier(VkCommandBuffer commands);

}  // namespace mray::gpu
