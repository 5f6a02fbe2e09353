// Commands of one backend, submitted to a device one batch at a time, and copies.
#pragma once

#include <optional>

#include "gpu/vulkan/device.h"

namespace mray::gpu {

using Record = std::function<void(VkCommandBuffer)>;

class Context {
public:
    /// A submission that takes longer than `timeout_ms` counts as a lost device.
    Context(Device& device, std::uint64_t timeout_ms);

    Device& device() { return device_; }
    const PhysicalDevice& physical() const { return device_.physical(); }

    /// Records, submits and waits; deferred work goes first. The commands see all writes of earlier
    /// submissions, and the host sees the writes of the commands. Returns the milliseconds of each
    /// stage of `record`, which stamp() separates; without timestamps the last is the whole wait.
    /// `what` is a verb with its object, for errors: kDeviceLost if the device is lost or does not
    /// finish in time (it is then given up), and kInternal for a validation error.
    std::vector<double> submit_stages(const char* what, const Record& record);
    /// submit_stages(), with the sum of the milliseconds.
    double submit(const char* what, const Record& record);
    /// Ends a stage of the commands that are being recorded.
    void stamp(VkCommandBuffer commands);
    /// The stages of an image: camera rays, shadow rays, shading.
    static constexpr std::uint32_t kMostStages = 3;

    /// Leaves work, once, to the next submission, after which `done` is called with the work's
    /// milliseconds. If that submission fails, the work is dropped.
    void defer(Record record, std::function<void(double)> done);
    bool has_deferred() const { return deferred_.has_value(); }
    void drop_deferred() { deferred_.reset(); }

private:
    struct Deferred {
        Record record;
        std::function<void(double)> done;
    };

    void record_all(const Record& record, const Deferred* deferred);
    void wait(const char* what);
    std::vector<double> stage_ms(double wall_ms) const;

    Device& device_;
    std::uint64_t timeout_ms_;
    UniqueCommandPool pool_;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    UniqueFence fence_;
    UniqueQueryPool queries_;
    std::optional<Deferred> deferred_;
    std::uint32_t stamp_count_ = 0;
};

/// Makes kernels and copies after it wait for those before it, and see their writes.
void barrier(VkCommandBuffer commands);

/// Copies to and from buffers: directly if mapped, otherwise in portions through a staging buffer.
class Transfer {
public:
    explicit Transfer(Context& context) : context_(context) {}

    /// Writes bytes to the start of `to`.
    void upload(std::span<const std::byte> bytes, const Buffer& to);
    /// Reads bytes from the start of `from`.
    void download(const Buffer& from, std::span<std::byte> bytes);
    /// Submits commands of a copy, if there are any.
    void run(const Record& copy);

private:
    void copy(const Buffer& from, const Buffer& to, const VkBufferCopy& range);
    const Buffer& staging();

    Context& context_;
    Buffer staging_;
};

}  // namespace mray::gpu
