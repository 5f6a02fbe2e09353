// A device, and the backends that scenes on it use.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/backend.h"
#include "common/base/thread_arena.h"
#include "common/simd/simd_target.h"
#include "cpu/cpu_backend.h"
#include "morphray/device.hpp"

namespace morphray::detail {

/// A backend holds one scene, so each scene has one of its own. Threads may share a DeviceImpl.
class DeviceImpl {
public:
    enum class Kind { cpu, vulkan, brute };

    DeviceImpl(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan,
               const VulkanHost& host);

    static Device make(Kind kind, const CpuOptions& cpu, const VulkanOptions& vulkan,
                       const VulkanHost& host = {});
    static DeviceImpl& of(const Device& device) { return *device.impl_; }

    const std::string& name() const { return name_; }
    const std::string& description() const { return description_; }
    int threads() const { return cpu_.threads; }
    /// For the host's work.
    const mray::SimdTarget& simd_target() const { return simd_target_; }
    /// Where the host's work for scenes runs: reading positions, converting and tracing rays.
    mray::ThreadArena& arena() { return arena_; }

    /// Takes a backend that no scene uses, or makes one. Throws mray::Error.
    std::unique_ptr<mray::Backend> take_backend();
    /// Keeps a device's backend for another scene: its kernels take seconds to compile.
    void give_back(std::unique_ptr<mray::Backend> backend) noexcept;

private:
    std::unique_ptr<mray::Backend> make_backend();
    std::unique_ptr<mray::Backend> make_vulkan_backend();

    Kind kind_;
    CpuOptions cpu_;
    VulkanOptions vulkan_;
    /// The device is null, or the caller's.
    VulkanHost host_;
    /// Guards the host's queue, which all scenes share.
    std::mutex queue_mutex_;
    mray::ThreadArena arena_;
    mray::SimdTarget simd_target_;
    std::string name_;
    std::string description_;
    std::mutex mutex_;
    std::vector<std::unique_ptr<mray::Backend>> idle_;
};

/// A backend of a device, which gets it back. The Device must outlive it.
struct GiveBack {
    DeviceImpl* device = nullptr;
    void operator()(mray::Backend* backend) const noexcept {
        device->give_back(std::unique_ptr<mray::Backend>(backend));
    }
};
using DeviceBackend = std::unique_ptr<mray::Backend, GiveBack>;
DeviceBackend take_backend(const Device& device);

}  // namespace morphray::detail
