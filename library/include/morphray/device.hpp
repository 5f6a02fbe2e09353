// Where scenes live and rays are traced.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "morphray/error.hpp"

namespace morphray {

namespace detail {
class DeviceImpl;
}

struct CpuOptions {
    /// 0: one for each processor. Results do not depend on it.
    int threads = 0;
    /// One of simd_targets(); empty: the best; "off": portable C++. Results do not depend on it.
    std::string simd = {};
};

struct VulkanOptions {
    /// An index of vulkan_devices(), a part of one device's name, or a UUID (dashes ignored).
    /// Empty: the first usable device, discrete before integrated, virtual, CPU.
    std::string device = {};
    /// Enables the Khronos validation layer; a call that it objects to throws ErrorCode::internal.
    bool validate = false;
};

/// A handle to a device; copies share it, and moving copies. Threads may use one at the same time,
/// for any number of scenes. A scene keeps its device alive.
class MORPHRAY_API Device {
public:
    Device(const Device&) = default;
    Device& operator=(const Device&) = default;

    /// The processors of this machine. Throws bad_argument for an unknown instruction set or
    /// negative threads, and unavailable for an instruction set that the machine lacks.
    static Device cpu(const CpuOptions& options = {});
    /// A Vulkan 1.1 device. Kernels are compiled when a scene first needs them, which takes from
    /// 0.1 s to some seconds. The first use of a device and driver tests it (DeviceCheck). Throws
    /// unavailable: not built in, no Vulkan library, driver or such device, an ambiguous name, a
    /// missing feature, wrong results in the test, or a parent process that has used Vulkan before
    /// a fork. Throws device_lost if the test is not answered.
    static Device vulkan(const VulkanOptions& options = {});
    /// Tests every triangle for every ray, without a tree: for checks of small scenes.
    static Device brute_force(const CpuOptions& options = {});

    /// "cpu", "vulkan" or "brute".
    const std::string& name() const;
    /// For people: instruction set and threads, or the device's name and driver.
    std::string description() const;

private:
    friend class detail::DeviceImpl;
    explicit Device(std::shared_ptr<detail::DeviceImpl> impl);
    std::shared_ptr<detail::DeviceImpl> impl_;
};

/// The instruction sets that Device::cpu() accepts on this machine, the best one first.
MORPHRAY_API std::vector<std::string> simd_targets();

struct VulkanDeviceInfo {
    std::uint32_t index = 0;
    std::string name;
    /// "discrete", "integrated", "virtual", "cpu" or "other".
    std::string type;
    std::string driver;
    std::string uuid;
    /// The version of Vulkan that the device supports.
    std::uint32_t api_major = 0;
    std::uint32_t api_minor = 0;
    std::uint64_t memory_bytes = 0;
    std::uint32_t subgroup_size = 0;
    /// What the device lacks; empty if Device::vulkan() can use it.
    std::string unusable;
};

/// Throws unavailable: not built in, no Vulkan library, no driver, a broken driver.
MORPHRAY_API std::vector<VulkanDeviceInfo> vulkan_devices();

/// The result of a device's self-test: whether hits, shading and refits have the CPU's bits.
struct DeviceCheck {
    bool passed = false;
    /// One line: device, driver, what is wrong, and what to do. Empty if the test was passed.
    std::string problem = {};
    /// What Device::vulkan() throws: unavailable for wrong results, device_lost for no answer.
    ErrorCode code = ErrorCode::unavailable;
};

/// Tests the device that VulkanOptions::device names, in this process. A device that does not
/// answer a dispatch within 20 s is given up, and never destroyed. Keeps the result for this
/// device, driver and version of the library, in $XDG_CACHE_HOME/morphray or ~/.cache/morphray.
/// Throws as Device::vulkan(), and limit.
MORPHRAY_API DeviceCheck check_vulkan_device(const std::string& device = {});
/// The result that is kept for a device, if there is one. Throws as Device::vulkan().
MORPHRAY_API std::optional<DeviceCheck> kept_device_check(const std::string& device = {});
/// Keeps and returns the failure of a device whose test a caller had to end; `what` says how it
/// ended. Throws as Device::vulkan().
MORPHRAY_API DeviceCheck keep_lost_device(const std::string& device, const std::string& what);

}  // namespace morphray
