// A device, its queue, and work submitted to it one batch at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "gpu/tuning.h"
#include "gpu/vulkan/device_info.h"
#include "gpu/vulkan/instance.h"
#include "gpu/vulkan/unique_handle.h"

namespace morphray::gpu {

/// Records commands.
using Record = std::function<void(VkCommandBuffer)>;

/// What a submission does with work that was deferred.
enum class Deferred { kLeft, kTaken };

class Context {
public:
    /// Throws Error as make_vulkan_backend.
    Context(const VulkanConfig& config, const Tuning& tuning);

    VkDevice device() const { return device_.get(); }
    const PhysicalDevice& physical() const { return physical_; }
    const VkPhysicalDeviceLimits& limits() const { return physical_.limits; }
    bool force_staging() const { return tuning_.force_staging; }

    /// Records and submits, nothing else being under way. What earlier submissions wrote is visible
    /// to the commands, and what the commands write is visible to the host after end(). `what` must
    /// live until then.
    void begin(const char* what, const Record& record, Deferred deferred = Deferred::kLeft);
    bool is_under_way() const { return what_ != nullptr; }
    /// Waits for it. Returns the milliseconds that its stages took on the device, those from the
    /// start to the first stamp(), to the next, to the end. (Where the device has no timestamps,
    /// all of the wait counts for the last one.) Throws Error(kDeviceLost) when the device is lost
    /// or does not finish in time, and Error(kInternal) when the validation layer reported an
    /// error.
    std::vector<double> end();
    /// begin() and end(); returns the milliseconds of all.
    double submit(const char* what, const Record& record, Deferred deferred = Deferred::kLeft);
    /// Ends a stage of what is being recorded; there can be kMostStages.
    void stamp(VkCommandBuffer commands);
    static constexpr std::uint32_t kMostStages = 6;

    /// Leaves work, one piece of it at most, to the next submission that takes it and does it
    /// first; `done` is told the milliseconds at its end(). Where that submission or one before it
    /// fails, it is not done.
    void defer(Record record, std::function<void(double)> done);
    /// Whether there is some that has not been submitted.
    bool has_deferred() const { return deferred_.has_value(); }
    void drop_deferred() { deferred_.reset(); }

    /// Waits for what is under way, and forgets it.
    void abandon();

    /// Names an object for debuggers and validation messages.
    template <class Handle>
    void name(VkObjectType type, Handle handle, const std::string& text) {
        // Non-dispatchable handles are pointers on 64-bit machines and integers elsewhere.
        if constexpr (std::is_pointer_v<Handle>) {
            name_object(type, reinterpret_cast<std::uintptr_t>(handle), text);
        } else {
            name_object(type, handle, text);
        }
    }

    /// Throws Error(kInternal) if the validation layer reported an error since the last call.
    void throw_on_validation_errors() { log_.throw_if_new(); }

private:
    /// Destroyed only after all its work is done: also after an error in the middle of it.
    class Device {
    public:
        explicit Device(VkDevice handle) : handle_(handle) {}
        Device(const Device&) = delete;
        Device& operator=(const Device&) = delete;
        ~Device() { vkDestroyDevice(handle_, nullptr); }
        VkDevice get() const { return handle_; }

    private:
        VkDevice handle_;
    };

    struct DeferredWork {
        Record record;
        std::function<void(double)> done;
    };

    void name_object(VkObjectType type, std::uint64_t handle, const std::string& text);
    void record_all(const Record& record);
    void wait(const char* what);
    std::vector<double> stage_ms(double wall_ms) const;

    Tuning tuning_;
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
    /// What is under way, or null; what was deferred to it; when it was submitted, and how many
    /// times it is stamped.
    const char* what_ = nullptr;
    std::optional<DeferredWork> under_way_;
    std::chrono::steady_clock::time_point begin_time_;
    std::uint32_t stamp_count_ = 0;
};

/// One dependency between what is recorded before and after.
void barrier(VkCommandBuffer commands, VkPipelineStageFlags from_stage, VkAccessFlags from,
             VkPipelineStageFlags to_stage, VkAccessFlags to);

}  // namespace morphray::gpu
