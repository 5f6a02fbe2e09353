// The kernels of the backend, each compiled when it is first needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/watch.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/context.h"

namespace mray::gpu {

class Kernel {
public:
    /// `constants`: kConstantStepBudget and what follows it. With the arguments `nothing` a
    /// workgroup writes nothing.
    template <class Arguments>
    Kernel(std::span<const std::uint32_t> texels, std::span<const std::uint32_t> storage,
           std::vector<std::uint32_t> constants, const Arguments& nothing)
        : texels_(texels), storage_(storage), constants_(std::move(constants)) {
        const auto bytes = std::as_bytes(std::span(&nothing, 1));
        nothing_.assign(bytes.begin(), bytes.end());
    }

    /// Records `group_count` workgroups of a kernel that is ready, with these arguments.
    template <class Arguments>
    void dispatch(VkCommandBuffer commands, const Arguments& arguments,
                  std::uint32_t group_count) const {
        pipeline_->dispatch(commands, arguments, group_count);
    }

private:
    friend class Kernels;

    /// The SPIR-V for each BufferKind.
    std::span<const std::uint32_t> texels_;
    std::span<const std::uint32_t> storage_;
    std::vector<std::uint32_t> constants_;
    std::vector<std::byte> nothing_;
    BufferKind kind_ = BufferKind::kTexels;
    std::optional<BoundPipeline> pipeline_;
    std::uint64_t bound_version_ = 0;
};

/// A kernel with a short stack, and the same one for what that suspends.
struct QueryKernel {
    QueryKernel(std::span<const std::uint32_t> texels, std::span<const std::uint32_t> storage,
                std::uint32_t steps)
        : begin(texels, storage, {steps, kShortStack}, QueryArguments{}),
          resume(texels, storage, {steps, kMaxStack}, QueryArguments{}) {}

    Kernel begin;
    Kernel resume;
};

inline std::uint32_t groups_of(std::uint32_t lanes) {
    return (lanes + kGroupSize - 1) / kGroupSize;
}

class Kernels {
public:
    Kernels(SharedDevice& device, Context& context, std::uint32_t steps);
    Kernels(const Kernels&) = delete;

    /// Kernels read buffers of this kind from now on.
    void set_bindings(BufferKind kind, const Bindings& bindings) {
        kind_ = kind;
        bindings_ = bindings;
        ++version_;
    }

    /// Makes kernels of this object ready to be dispatched, until the resources change. New ones,
    /// the fastest to compile first, are compiled in two threads and dispatched once over nothing,
    /// since lavapipe finishes compiling at the first dispatch: times exclude compiling. Deferred
    /// work runs meanwhile. After an Error, such as kCancelled, it can be called again.
    void prepare(const std::vector<Kernel*>& needed, const Watch& watch = {});

private:
    bool is_compiled(const Kernel& kernel) const {
        return kernel.pipeline_ && kernel.kind_ == kind_;
    }
    void compile(Kernel& kernel);
    void make_ready(Kernel& kernel);

    SharedDevice& device_;
    Context& context_;
    BufferKind kind_ = BufferKind::kTexels;
    Bindings bindings_;
    std::uint64_t version_ = 0;

public:
    Kernel primary, rays, compact, occlusion, decide, resume;
    QueryKernel hits, winding, closest;
    Kernel shade, pack_hits, find_surfaces, flat_shadows, lit;
    Kernel move_bodies, refit_leaves, refit_nodes;
};

}  // namespace mray::gpu
