// A kernel that is compiled when it is first needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "gpu/vulkan/pipeline.h"

namespace mray::gpu {

class Kernel {
public:
    /// `constants` are the specialisation constants 0, 1, ...; `nothing` are the arguments of a
    /// workgroup that has no work and writes nothing.
    template <class Arguments>
    Kernel(const char* name, std::span<const std::uint32_t> spirv,
           std::vector<std::uint32_t> constants, const Arguments& nothing)
        : name_(name), spirv_(spirv), constants_(std::move(constants)) {
        const auto bytes = std::as_bytes(std::span(&nothing, 1));
        nothing_.assign(bytes.begin(), bytes.end());
    }

    /// Compiles the kernel, unless that is done. Threads may compile different kernels of a context
    /// at the same time. Throws Error, and can then be called again.
    void compile(Context& context);
    bool is_compiled() const { return pipeline_.has_value(); }

    /// Binds the resources that the kernel uses; all of them must be there. Does nothing before
    /// the kernel is compiled.
    void bind(const Bindings& bindings);

    /// Records `group_count` workgroups of a compiled and bound kernel, with these arguments.
    template <class Arguments>
    void dispatch(VkCommandBuffer commands, const Arguments& arguments,
                  std::uint32_t group_count) const {
        pipeline_->dispatch(commands, arguments, group_count);
    }
    /// Records a workgroup without work.
    void dispatch_nothing(VkCommandBuffer commands) const {
        pipeline_->dispatch_bytes(commands, nothing_, 1);
    }

private:
    const char* name_;
    std::span<const std::uint32_t> spirv_;
    std::vector<std::uint32_t> constants_;
    std::vector<std::byte> nothing_;
    std::optional<Pipeline> pipeline_;
};

}  // namespace mray::gpu
