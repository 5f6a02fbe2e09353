// Which Vulkan device is used and how, and its description.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

struct VkInstance_T;

namespace mray::gpu {

class ValidationLog;

/// PFN_vkGetInstanceProcAddr, without Vulkan's header.
using LoaderFunction = void (*(*)(VkInstance_T* instance, const char* name))();

struct VulkanConfig {
    /// An index of list_devices(), a part of the name of one device only, or a UUID (32 hex digits,
    /// dashes ignored). Empty: the first usable device, discrete before integrated, virtual, CPU.
    std::string device;
    /// Enables the Khronos validation layer (core, synchronisation). A call that causes a message
    /// of error severity throws Error(kInternal).
    bool validate = false;
};

enum class BufferKind {
    kTexels,   // which lavapipe reads three times as fast
    kStorage,  // which others read as fast, without the limit of 2^27 texels
};

/// Settings that change no result. Tests use them to reach rare paths.
struct Tuning {
    /// Iterations after which a lane suspends its ray, to kStepBudget; 0: step_budget().
    std::uint32_t step_budget = 0;
    /// Tiles of 8x8 pixels, or 64 rays, of one dispatch at most; 0: by the device (pass_size()).
    std::uint32_t tiles_per_dispatch = 0;
    /// Suspended rays of 2 KB each that one dispatch continues; 0: by the device.
    std::uint32_t resume_slots = 0;
    /// The kind of buffers that kernels read, if the device can bind it; unset: by device and scene
    /// (choose_buffers()).
    std::optional<BufferKind> buffer_kind = std::nullopt;
    /// Copies through a staging buffer even if the host sees the device's memory.
    bool force_staging = false;
    std::uint64_t submit_timeout_ms = 60'000;
    LoaderFunction loader = nullptr;
    /// Receives validation errors, including those at destruction. Must outlive the backend.
    ValidationLog* log = nullptr;
};

struct DeviceInfo {
    std::uint32_t index = 0;
    std::string name;
    std::string type;
    std::string driver;
    std::string uuid;
    std::uint32_t api_major = 0;
    std::uint32_t api_minor = 0;
    std::uint64_t memory_bytes = 0;
    std::uint32_t subgroup_size = 0;
    /// Empty if morphray can use the device; otherwise the features that it lacks.
    std::string unusable;
    /// True if the driver promises what kernel.glsl demands of floats: rounding to the nearest,
    /// signs of zeros, infinities and NaNs kept. Otherwise kernels do not demand it.
    bool promises_floats = false;
    /// True for lavapipe, which reads texels faster than storage buffers.
    bool prefers_texels = false;
};

}  // namespace mray::gpu
