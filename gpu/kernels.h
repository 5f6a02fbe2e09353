// The kernels of the backend, each compiled when it is first needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <vector>

#include "common/base/watch.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/context.h"

namespace mray::gpu {

struct KernelWords {
    std::span<const std::uint32_t> texels;
    std::span<const std::uint32_t> storage;
};

class Kernel {
public:
    /// `steps` is the budget of a lane (kConstantStepBudget); with the arguments `nothing` a
    /// workgroup writes nothing.
    template <class Arguments>
    Kernel(const KernelWords& words, BufferKind kind, std::uint32_t steps, const Arguments& nothing)
        : spirv_(kind == BufferKind::kTexels ? words.texels : words.storage), steps_(steps) {
        const auto bytes = std::as_bytes(std::span(&nothing, 1));
        nothing_.assign(bytes.begin(), bytes.end());
    }

    /// Compiles the kernel once. Threads may compile different kernels of a device at the same
    /// time. Throws Error, and can then be called again.
    void compile(SharedDevice& device);
    /// Whether it is compiled and has been dispatched.
    bool is_ready() const { return pipeline_.has_value() && pipeline_->pipeline().is_warm(); }
    void set_ready() { pipeline_->pipeline().set_warm(); }

    /// Binds the resources that the kernel uses, unless this version of them is bound; none may be
    /// missing. Not while work that uses them is recorded or under way.
    void bind(const Bindings& bindings, std::uint64_t version);

    /// Records `group_count` workgroups of a compiled and bound kernel, with these arguments.
    template <class Arguments>
    void dispatch(VkCommandBuffer commands, const Arguments& arguments,
                  std::uint32_t group_count) const {
        pipeline_->dispatch(commands, arguments, group_count);
    }
    /// Records a workgroup that writes nothing.
    void dispatch_nothing(VkCommandBuffer commands) const {
        pipeline_->dispatch_bytes(commands, nothing_, 1);
    }

private:
    std::span<const std::uint32_t> spirv_;
    std::uint32_t steps_;
    std::vector<std::byte> nothing_;
    std::optional<BoundPipeline> pipeline_;
    std::uint64_t bound_version_ = 0;
};

inline std::uint32_t groups_of(std::uint32_t lanes) {
    return (lanes + kGroupSize - 1) / kGroupSize;
}

class Kernels {
public:
    Kernels(SharedDevice& device, Context& context, BufferKind kind, std::uint32_t steps);
    Kernels(const Kernels&) = delete;

    void set_bindings(const Bindings& bindings);

    /// Makes kernels of this object ready to be dispatched, until the resources change. New ones,
    /// the fastest to compile first, are compiled in two threads and dispatched once over nothing,
    /// since lavapipe finishes compiling at the first dispatch: times exclude compiling. Deferred
    /// work runs meanwhile. Throws Error, and can then be called again: Error(kCancelled) between
    /// two kernels.
    void prepare(std::span<Kernel* const> needed, const Watch& watch = {});
    void prepare(std::initializer_list<Kernel*> needed) {
        prepare(std::span(needed.begin(), needed.size()));
    }

private:
    void make_ready(Kernel& kernel);

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
};

}  // namespace mray::gpu
