// A device, its queue, and work submitted to it one batch at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "gpu/vulkan/device_info.h"
#include "gpu/vulkan/instance.h"
#include "gpu/vulkan/tuning.h"
#include "gpu/vulkan/unique_handle.h"

namespace mray::gpu {

/// Records commands.
using Record = std::function<void(VkCommandBuffer)>;

class Context {
public:
    /// Throws Error as make_vulkan_backend, and if the device lacks one of the extras, which a
    /// host's device is not asked for.
    Context(const VulkanConfig& config, const Tuning& tuning);

    VkDevice device() const { return device_.get(); }
    const PhysicalDevice& physical() const { return physical_; }
    const VkPhysicalDeviceLimits& limits() const { return physical_.limits; }
    bool force_staging() const { return tuning_.force_staging; }

    /// Records, submits and waits; deferred work goes first. The commands see all writes of earlier
    /// submissions, and the host sees the writes of the commands. Returns the milliseconds that the
    /// stages of `record` took on the device: from its start to the first stamp(), to the next, to
    /// its end. (On a device without timestamps the last one is all of the wait.) `what` is for
    /// errors, a verb with its object. Throws Error(kDeviceLost) if the device is lost or does not
    /// finish in time, and Error(kInternal) if the validation layer reported an error.
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

    /// Names an object for debuggers and validation messages.
    template <class Handle>
    void name(VkObjectType type, Handle handle, const std::string& text) {
        // Non-dispatchable handles are pointers on 64-bit machines and integers on others.
        if constexpr (std::is_pointer_v<Handle>) {
            name_object(type, reinterpret_cast<std::uintptr_t>(handle), text);
        } else {
            name_object(type, handle, text);
        }
    }

    /// Throws Error(kInternal) if the validation layer reported an error since the last call.
    void throw_on_validation_errors() { log_.throw_if_new(); }

private:
    class Device {
    public:
        Device(VkDevice handle, bool is_own) : handle_(handle), is_own_(is_own) {}
        Device(const Device&) = delete;
        Device& operator=(const Device&) = delete;
        ~Device() {
            if (!is_own_) return;
            const std::scoped_lock lock(loader_mutex());
            vkDestroyDevice(handle_, nullptr);
        }
        VkDevice get() const { return handle_; }

    private:
        VkDevice handle_;
        bool is_own_;
    };

    struct DeferredWork {
        Record record;
        std::function<void(double)> done;
    };

    void name_object(VkObjectType type, std::uint64_t handle, const std::string& text);
    void record_all(const Record& record, const DeferredWork* deferred);
    void submit_commands();
    void wait_until_idle();
    void wait(const char* what);
    std::vector<double> stage_ms(double wall_ms) const;

    Tuning tuning_;
    std::shared_ptr<const HostDevice> host_;
    ValidationLog own_log_;
    ValidationLog& log_;
    Instance instance_;
    PhysicalDevice physical_;
    Device device_;
    VkQueue queue_ = VK_NULL_HANDLE;
    UniqueCommandPool pool_;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    UniqueFence fence_;
    UniqueQueryPool queries_;
    std::optional<DeferredWork> deferred_;
    /// Timestamps of the commands that are recorded or submitted.
    std::uint32_t stamp_count_ = 0;
};

/// Makes the commands recorded after it wait for those recorded before it.
void barrier(VkCommandBuffer commands, VkPipelineStageFlags from_stage, VkAccessFlags from,
             VkPipelineStageFlags to_stage, VkAccessFlags to);

}  // namespace mray::gpu
