// A device, and the backends that scenes on it use.
#pragma once

#include <mutex>

#include "common/backend.h"
#include "common/base/thread_arena.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"
#include "morphray/device.hpp"

namespace mray::gpu {
struct SharedDevice;
}

namespace morphray::detail {

/// A backend holds one scene, so each scene has one of its own. Threads may share a DeviceImpl.
class DeviceImpl {
public:
    enum class Kind { cpu, vulkan, brute };

    DeviceImpl(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan);

    static Device make(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan);
    static DeviceImpl& of(const Device& device) { return *device.impl_; }

    const std::string& name() const { return name_; }
    const std::string& description() const { return description_; }
    int threads() const { return cpu_.threads; }
    /// For the host's work: reading positions, converting and tracing rays.
    const mray::SimdTarget& simd_target() const { return simd_target_; }
    mray::ThreadArena& arena() { return arena_; }

    /// A backend for a scene. Those of a Vulkan device share what is compiled. Throws mray::Error.
    std::unique_ptr<mray::Backend> make_backend();

private:
    Kind kind_;
    CpuOptions cpu_;
    VulkanOptions vulkan_;
    mray::ThreadArena arena_;
    mray::SimdTarget simd_target_;
    std::string name_;
    std::string description_;
    /// Guards the device of Vulkan, which is null until the first backend.
    std::mutex mutex_;
    std::shared_ptr<mray::gpu::SharedDevice> shared_;
};

/// Has both backends trace, shade, refit and query a small scene. Returns what differs first, such
/// as "closest hits"; empty if all bits are equal. Throws what the backends throw.
std::string find_difference(mray::Backend& tested, mray::Backend& reference);

/// True if the tested backend takes denormals for 0, unlike the reference. No result depends on
/// that (docs/design/arithmetic.md, "No denormals").
bool flushes_denormals(mray::Backend& tested, mray::Backend& reference);

}  // namespace morphray::detail
