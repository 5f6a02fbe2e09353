#include "gpu/vulkan/spirv.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "common/base/errors.h"

namespace mray::gpu {
namespace {

// Numbers of the SPIR-V specification.
enum Op : std::uint32_t {
    kTypeImage = 25,
    kTypeSampledImage = 27,
    kTypePointer = 32,
    kVariable = 59,
    kDecorate = 71,
};
enum Decoration : std::uint32_t { kBinding = 33, kDescriptorSet = 34 };
enum StorageClass : std::uint32_t { kUniformConstant = 0, kUniform = 2, kStorageBuffer = 12 };

[[noreturn]] void refuse(const std::string& text) {
    throw Error(ErrorKind::kInternal, "SPIR-V: " + text);
}

using Types = std::map<std::uint32_t, SpirvInstruction>;

/// `usamplerBuffer` and `uimageBuffer` of GLSL.
VkDescriptorType opaque_type(const Types& types, std::uint32_t id) {
    constexpr std::uint32_t kBuffer = 5;
    constexpr std::uint32_t kSampledImage = 1;
    const auto type_of = [&](std::uint32_t type) -> const SpirvInstruction& {
        const auto place = types.find(type);
        if (place == types.end()) refuse("a resource that is not a buffer");
        return place->second;
    };
    const SpirvInstruction& type = type_of(id);
    const SpirvInstruction& image =
        type.opcode == kTypeSampledImage ? type_of(type.operands[1]) : type;
    if (image.opcode != kTypeImage || image.operands[2] != kBuffer)
        refuse("a resource that is not a buffer");
    return image.operands[6] == kSampledImage ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
                                              : VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER;
}

}  // namespace

std::vector<SpirvInstruction> read_spirv(std::span<const std::uint32_t> words) {
    constexpr std::size_t kHeaderWords = 5;
    constexpr std::uint32_t kMagic = 0x07230203;
    if (words.size() < kHeaderWords || words[0] != kMagic) refuse("not a module");
    std::vector<SpirvInstruction> instructions;
    for (std::size_t at = kHeaderWords; at < words.size();) {
        const std::uint32_t count = words[at] >> 16;
        if (count == 0 || at + count > words.size()) refuse("a broken module");
        instructions.push_back({words[at] & 0xFFFF, words.subspan(at + 1, count - 1)});
        at += count;
    }
    return instructions;
}

std::vector<ShaderBinding> shader_bindings(std::span<const std::uint32_t> words) {
    const std::vector<SpirvInstruction> instructions = read_spirv(words);
    Types types;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> decorations;
    // Types and decorations come before variables.
    std::vector<ShaderBinding> bindings;
    for (const SpirvInstruction& i : instructions) {
        const auto& o = i.operands;
        if (i.opcode == kTypeImage || i.opcode == kTypeSampledImage || i.opcode == kTypePointer)
            types[o[0]] = i;
        if (i.opcode == kDecorate && o.size() == 3) decorations[{o[0], o[1]}] = o[2];
        if (i.opcode != kVariable) continue;
        const std::uint32_t storage = o[2];
        if (storage == kUniform) refuse("a uniform buffer");
        if (storage != kUniformConstant && storage != kStorageBuffer) continue;
        if (decorations[{o[1], kDescriptorSet}] != 0) refuse("a second descriptor set");
        bindings.push_back(
            {decorations[{o[1], kBinding}], storage == kStorageBuffer
                                                ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
                                                : opaque_type(types, types[o[0]].operands[2])});
    }
    std::ranges::sort(bindings, {}, &ShaderBinding::number);
    return bindings;
}

}  // namespace mray::gpu
