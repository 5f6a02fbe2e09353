// Reads from a kernel's SPIR-V the resources that it uses.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gpu/vulkan/vulkan_api.h"

namespace mray::gpu {

struct SpirvInstruction {
    std::uint32_t opcode;
    /// Without the first word, which holds the opcode.
    std::span<const std::uint32_t> operands;
};

/// The instructions of a module, whose words must outlive them. Throws Error(kInternal) on words
/// that are not a module.
std::vector<SpirvInstruction> read_spirv(std::span<const std::uint32_t> words);

struct ShaderBinding {
    std::uint32_t number;
    VkDescriptorType type;
    bool operator==(const ShaderBinding&) const = default;
};

struct ShaderInterface {
    /// All in descriptor set 0, ascending.
    std::vector<ShaderBinding> bindings;
    /// 0 without push constants.
    std::uint32_t argument_bytes = 0;
};

/// The interface of a kernel that uses texel buffers, storage buffers and push constants. Throws
/// Error(kInternal) on any other resource.
ShaderInterface shader_interface(std::span<const std::uint32_t> words);

}  // namespace mray::gpu
