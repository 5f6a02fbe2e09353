// A device, and the backends that scenes on it use.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/backend.h"
#include "common/base/thread_arena.h"
#include "common/simd/simd_target.h"
#include "morphray/device.hpp"

namespace morphray::detail {

/// A backend holds one scene, so each scene has one of its own. Threads may share a DeviceImpl.
class DeviceImpl {
public:
    /// Makes a backend for a scene; threads may call it at the same time. Throws mray::Error.
    using MakeBackend = std::function<std::unique_ptr<mray::Backend>()>;

    /// `host`: threads and instruction set of the host's work.
    explicit DeviceImpl(MakeBackend make, const CpuOptions& host = {});

    static Device make(MakeBackend make, const CpuOptions& host = {});
    /// As make(), for backends of gpu/vulkan_backend.h: the host answers what they cannot.
    static Device make_on_device(MakeBackend make);
    static DeviceImpl& of(const Device& device) { return *device.impl_; }

    /// Throws mray::Error.
    const MakeBackend make_backend;
    const int threads;
    /// For the host's work: reading positions, converting and tracing rays.
    mray::ThreadArena arena;
    const mray::SimdTarget simd_target;
    std::string name, description;
};

}  // namespace morphray::detail
