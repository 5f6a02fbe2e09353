// Where scenes live and rays are traced.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "morphray/error.hpp"

namespace morphray {

namespace detail {
class DeviceImpl;
}

struct CpuOptions {
    /// 0: one for each processor. Results do not depend on it.
    int threads = 0;
    /// An instruction set of simd_targets(); empty: the best of this machine. "off": portable C++
    /// without SIMD. Results do not depend on it.
    std::string simd = {};
};

struct VulkanOptions {
    /// An index of vulkan_devices(), a part of the name of one device only, or a UUID (32 hex
    /// digits, dashes ignored). Empty: the first usable device, discrete before integrated,
    /// virtual, CPU.
    std::string device = {};
    /// Enables the Khronos validation layer; a call that it objects to throws ErrorCode::internal.
    bool validate = false;
};

/// A handle to a device; copies share it. Threads may use one at the same time, for any number of
/// scenes. A scene keeps its device alive.
class MORPHRAY_API Device {
public:
    /// Moving copies, so that no Device is ever without a device.
    Device(const Device&) = default;
    Device& operator=(const Device&) = default;

    /// The processors of this machine. Throws bad_argument for an unknown instruction set or
    /// negative threads, and unavailable for an instruction set that the machine lacks.
    static Device cpu(const CpuOptions& options = {});
    /// A Vulkan 1.1 device. Each kind of query and update compiles its kernels when a scene first
    /// needs them, from 0.1 s to some seconds. Throws unavailable: not built in, no Vulkan library,
    /// no driver, no such device, an ambiguous name, a device that lacks a feature, or one that
    /// gives wrong results in its self-test (DeviceCheck), which is made when a device and driver
    /// are first used, or a parent has used Vulkan before a fork; device_lost: no answer in it.
    static Device vulkan(const VulkanOptions& options = {});
    /// Tests every triangle for every ray: no tree to be wrong about. For checks of small scenes.
    static Device brute_force(const CpuOptions& options = {});

    const std::string& name() const;  ///< "cpu", "vulkan" or "brute".
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
    std::string type;  ///< "discrete", "integrated", "virtual", "cpu" or "other".
    std::string driver;
    std::string uuid;
    std::uint32_t api_major = 0;  ///< It supports Vulkan api_major.api_minor.
    std::uint32_t api_minor = 0;
    std::uint64_t memory_bytes = 0;
    std::uint32_t subgroup_size = 0;  ///< The lanes that it runs together.
    /// Empty if Device::vulkan() can use the device; otherwise what it lacks.
    std::string unusable;
    /// True if the driver promises to round as the CPU does. If not, the self-test (DeviceCheck)
    /// alone shows that results are equal.
    bool promises_rounding = false;
};

/// Throws unavailable: not built in, no Vulkan library, no driver, a broken driver.
MORPHRAY_API std::vector<VulkanDeviceInfo> vulkan_devices();

/// The result of a device's self-test: the answers of digest() with fewer rays, and refitted trees,
/// compared with the CPU's bits. Rays and points touch vertices and edges, where any other
/// rounding, fused or reordered operations show.
struct DeviceCheck {
    bool passed = false;
    /// One line: device, driver, what is wrong, and what to do. Empty if the test was passed.
    std::string problem = {};
    /// What Device::vulkan() throws: unavailable for wrong results, device_lost for a device that
    /// is lost or does not answer.
    ErrorCode code = ErrorCode::unavailable;
    /// What a device that passed does otherwise without changing a result; mostly empty.
    std::string note = {};
};

/// Tests the device that VulkanOptions::device names, in this process. A dispatch that takes longer
/// than 60 s is a device that does not answer: it is given up, and never destroyed. Keeps the
/// result in $XDG_CACHE_HOME/morphray or ~/.cache/morphray, for this device, driver and version of
/// the library. Device::vulkan() does so for a device without a result. Throws as Device::vulkan(),
/// and limit.
MORPHRAY_API DeviceCheck check_vulkan_device(const std::string& device = {});
/// The result that is kept for a device, if there is one. Throws as Device::vulkan().
MORPHRAY_API std::optional<DeviceCheck> kept_device_check(const std::string& device = {});
/// Keeps the failure of a device whose test a caller had to end; `what` says how it ended. Returns
/// it. Throws as Device::vulkan().
MORPHRAY_API DeviceCheck keep_lost_device(const std::string& device, const std::string& what);

/// What digest() returns for every device: the number of this version, as README.md has it.
MORPHRAY_API extern const std::uint64_t kDigest;
/// Returns XXH3 (64 bits) of a device's answers about a small scene that deforms: to all queries of
/// rays and points, the hits and pixels of images by Shading::plain, and depths of stacks. The
/// scene is the same on every machine, so devices with one number agree in every bit of these
/// answers. Takes about a second, on a Vulkan device some seconds more to compile kernels, and by
/// brute force a minute. Threads may call it at the same time. Throws device_lost and limit.
MORPHRAY_API std::uint64_t digest(const Device& device);

}  // namespace morphray
