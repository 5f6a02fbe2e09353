// All kernels of the backend.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

#include "common/base/watch.h"
#include "gpu/kernel.h"
#include "gpu/vulkan/context.h"

namespace mray::gpu {

/// The number of workgroups that a number of lanes needs.
inline std::uint32_t groups_of(std::uint32_t lanes) {
    return (lanes + kGroupSize - 1) / kGroupSize;
}

class Kernels {
public:
    Kernels(SharedDevice& device, Context& context, const Tuning& tuning);
    Kernels(const Kernels&) = delete;

    /// Sets the resources that prepare() binds.
    void set_bindings(const Bindings& bindings);

    /// Gets kernels of this object ready to be dispatched, until the resources change. Those that
    /// the device has not compiled yet, the fastest to compile first, are compiled in two threads,
    /// and dispatched once over nothing, since some drivers, such as lavapipe, finish compiling a
    /// kernel at its first dispatch. So compiling is no part of the device's times. Deferred work
    /// runs in the meantime. Throws Error, and can then be called again: Error(kCancelled) between
    /// two kernels if the watch asks for it.
    void prepare(std::span<Kernel* const> needed, const Watch& watch = {});
    void prepare(std::initializer_list<Kernel*> needed) {
        prepare(std::span(needed.begin(), needed.size()));
    }

private:
    using Constants = std::vector<std::uint32_t>;
    Kernels(SharedDevice& device, Context& context, BufferKind kind, const Constants& of_rays,
            const Constants& of_queries);

    SharedDevice& device_;
    Context& context_;
    Bindings bindings_;
    std::uint64_t version_ = 0;

public:
    Kernel primary;
    Kernel rays;
    Kernel compact;
    Kernel occlusion;
    Kernel resume;
    Kernel hits;
    Kernel winding;
    Kernel closest;
    Kernel shade;
    Kernel refit_leaves;
    Kernel refit_nodes;

private:
    void make_ready(Kernel& kernel);
};

}  // namespace mray::gpu
