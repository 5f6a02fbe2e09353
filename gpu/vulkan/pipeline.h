// A kernel, ready to be dispatched.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "gpu/vulkan/context.h"
#include "gpu/vulkan/spirv.h"
#include "shaders/kernel_interface.h"

namespace mray::gpu {

/// The resource of each binding number, a view or a buffer; null if there is none.
struct Bindings {
    std::array<VkBufferView, kBindingCount> views = {};
    std::array<VkBuffer, kBindingCount> buffers = {};
};

class Pipeline {
public:
    /// Bindings and size of the arguments come from the SPIR-V. `specialisation` has values of the
    /// 32-bit constants 0, 1, ...; those that the kernel does not have are ignored.
    Pipeline(Context& context, const char* name, std::span<const std::uint32_t> spirv,
             std::span<const std::uint32_t> specialisation = {});

    /// Binds the resources that the kernel uses; all of them must be there.
    void bind(const Bindings& bindings);

    /// Records `group_count` workgroups with these arguments, the push constants of the kernel.
    template <class Arguments>
    void dispatch(VkCommandBuffer commands, const Arguments& arguments,
                  std::uint32_t group_count) const {
        dispatch_bytes(commands, std::as_bytes(std::span(&arguments, 1)), group_count);
    }
    void dispatch_bytes(VkCommandBuffer commands, std::span<const std::byte> arguments,
                        std::uint32_t group_count) const;

private:
    VkDevice device_;
    ShaderInterface interface_;
    UniqueDescriptorSetLayout set_layout_;
    UniquePipelineLayout layout_;
    UniquePipeline pipeline_;
    UniqueDescriptorPool pool_;
    VkDescriptorSet set_;
};

}  // namespace mray::gpu
