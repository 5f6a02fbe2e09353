// All kernels of the backend.
#pragma once

#include <array>
#include <initializer_list>
#include <span>
#include <vector>

#include "common/base/watch.h"
#include "gpu/kernel.h"

namespace mray::gpu {

/// The number of workgroups that a number of lanes needs.
inline std::uint32_t groups_of(std::uint32_t lanes) {
    return (lanes + kGroupSize - 1) / kGroupSize;
}

class Kernels {
public:
    Kernels(Context& context, const Tuning& tuning);
    Kernels(const Kernels&) = delete;

    /// Binds all kernels, those that are compiled later, too.
    void bind(const Bindings& bindings);

    /// Gets kernels of this object ready to be dispatched. Those that are not yet, the fastest to
    /// compile first, are compiled in two threads, and dispatched once over nothing, since some
    /// drivers, such as lavapipe, finish compiling a kernel at its first dispatch. So compiling is
    /// no part of the device's times. Deferred work runs in the meantime. Throws Error, and can
    /// then be called again: Error(kCancelled) between two kernels if the watch asks for it.
    void prepare(std::span<Kernel* const> needed, const Watch& watch = {});
    void prepare(std::initializer_list<Kernel*> needed) {
        prepare(std::span(needed.begin(), needed.size()));
    }

private:
    Context& context_;
    Bindings bindings_;

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
    std::array<Kernel*, 11> all();
    void make_ready(Kernel& kernel);

    /// Kernels that have been dispatched.
    std::vector<const Kernel*> ready_;
};

}  // namespace mray::gpu
