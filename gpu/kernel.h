// A kernel that is compiled when it is first needed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "gpu/shared_device.h"

namespace mray::gpu {

/// The words of a kernel for each BufferKind.
struct KernelWords {
    std::span<const std::uint32_t> texels;
    std::span<const std::uint32_t> storage;
};

class Kernel {
public:
    /// `constants` are the specialisation constants 0, 1, ...; `nothing` are the arguments of a
    /// workgroup that has no work and writes nothing.
    template <class Arguments>
    Kernel(const char* name, const KernelWords& words, BufferKind kind,
           std::vector<std::uint32_t> constants, const Arguments& nothing)
        : name_(name),
          spirv_(kind == BufferKind::kTexels ? words.texels : words.storage),
          constants_(std::move(constants)) {
        const auto bytes = std::as_bytes(std::span(&nothing, 1));
        nothing_.assign(bytes.begin(), bytes.end());
    }

    /// Compiles the kernel, unless that is done. Threads may compile different kernels of a device
    /// at the same time. Throws Error, and can then be called again.
    void compile(SharedDevice& device);
    /// Whether it is compiled and has been dispatched.
    bool is_ready() const { return pipeline_.has_value() && pipeline_->pipeline().is_warm(); }
    void set_ready() { pipeline_->pipeline().set_warm(); }

    /// Binds the resources that the kernel uses, unless those of this version are bound; all of
    /// them must be there. Not while work that uses them is recorded or under way.
    void bind(const Bindings& bindings, std::uint64_t version);

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
    std::optional<BoundPipeline> pipeline_;
    std::uint64_t bound_version_ = 0;
};

}  // namespace mray::gpu
