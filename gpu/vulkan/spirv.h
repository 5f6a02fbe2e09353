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

/// The instructions of a module; its words outlive them. Throws Error(kInternal) on other words.
std::vector<SpirvInstruction> read_spirv(std::span<const std::uint32_t> words);

struct ShaderBinding {
    std::uint32_t number;
    VkDescriptorType type;
    bool operator==(const ShaderBinding&) const = default;
};

/// The bindings, ascending, of a kernel that uses texel buffers and storage buffers of descriptor
/// set 0. Throws Error(kInternal) on any other resource.
std::vector<ShaderBinding> shader_bindings(std::span<const std::uint32_t> words);

}  // namespace mray::gpu
