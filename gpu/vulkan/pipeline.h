// A kernel, ready to be dispatched.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "gpu/vulkan/context.h"
#include "shaders/kernel_interface.h"

namespace morphray::gpu {

/// What each binding number stands for; null where nothing is bound.
struct Bindings {
    std::array<VkBufferView, kBindingCount> views = {};
    std::array<VkBuffer, kBindingCount> buffers = {};
};

VkDescriptorType descriptor_type(std::uint32_t binding);

class Pipeline {
public:
    struct Source {
        const char* name;
        std::span<const std::uint32_t> spirv;
        /// The binding numbers that the kernel uses.
        std::vector<std::uint32_t> bindings;
        std::uint32_t argument_bytes;
    };

    /// None: neither bound nor dispatched.
    Pipeline() = default;
    /// specialisation: values of the 32-bit constants 0, 1, ...; those that the kernel does not
    /// have are ignored.
    Pipeline(Context& context, const Source& source,
             std::span<const std::uint32_t> specialisation = {});

    /// Binds what the kernel uses. No work may be under way.
    void bind(const Bindings& bindings);

    /// Records `group_count` workgroups.
    template <class Arguments>
    void dispatch(VkCommandBuffer commands, const Arguments& arguments,
                  std::uint32_t group_count) const {
        dispatch_bytes(commands, std::as_bytes(std::span(&arguments, 1)), group_count);
    }

private:
    void dispatch_bytes(VkCommandBuffer commands, std::span<const std::byte> arguments,
                        std::uint32_t group_count) const;

    VkDevice device_ = VK_NULL_HANDLE;
    std::vector<std::uint32_t> used_;
    UniqueDescriptorSetLayout set_layout_;
    UniquePipelineLayout layout_;
    UniquePipeline pipeline_;
    UniqueDescriptorPool pool_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
};

}  // namespace morphray::gpu
