#include "gpu/vulkan/spirv.h"

#include <algorithm>
#include <map>
#include <string>

#include "common/base/errors.h"

namespace mray::gpu {
namespace {

// Numbers of the SPIR-V specification.
enum Op : std::uint32_t {
    kTypeInt = 21,
    kTypeFloat = 22,
    kTypeVector = 23,
    kTypeImage = 25,
    kTypeSampledImage = 27,
    kTypeArray = 28,
    kTypeStruct = 30,
    kTypePointer = 32,
    kConstant = 43,
    kVariable = 59,
    kDecorate = 71,
    kMemberDecorate = 72,
};
enum Decoration : std::uint32_t {
    kArrayStride = 6,
    kBinding = 33,
    kDescriptorSet = 34,
    kOffset = 35,
};
enum StorageClass : std::uint32_t {
    kUniformConstant = 0,
    kUniform = 2,
    kPushConstant = 9,
    kStorageBuffer = 12,
};

[[noreturn]] void refuse(const std::string& text) {
    throw Error(ErrorKind::kInternal, "SPIR-V: " + text);
}

/// The types, constants and decorations of a module, by id.
class Types {
public:
    explicit Types(std::span<const SpirvInstruction> instructions) {
        for (const SpirvInstruction& i : instructions) {
            const auto& o = i.operands;
            const bool is_type = i.opcode >= kTypeInt && i.opcode <= kTypePointer;
            if (is_type) types_[o[0]] = i;
            if (i.opcode == kConstant) constants_[o[1]] = o[2];
            if (i.opcode == kDecorate && o.size() == 3) decorations_[{o[0], o[1]}] = o[2];
            if (i.opcode == kMemberDecorate && o[2] == kOffset) offsets_[{o[0], o[1]}] = o[3];
        }
    }

    const SpirvInstruction& operator[](std::uint32_t id) const { return find(types_, id, "type"); }

    std::uint32_t decoration(std::uint32_t id, Decoration decoration) const {
        return find(decorations_, {id, decoration}, "decoration");
    }

    /// Bytes from the start of a type to its end, without padding after it.
    std::uint32_t size_of(std::uint32_t id) const {
        const SpirvInstruction& type = (*this)[id];
        const auto& o = type.operands;
        switch (type.opcode) {
            case kTypeInt:
            case kTypeFloat:
                return o[1] / 8;
            case kTypeVector:
                return size_of(o[1]) * o[2];
            case kTypeArray:
                return decoration(id, kArrayStride) * find(constants_, o[2], "constant");
            case kTypeStruct: {
                std::uint32_t size = 0;
                for (std::uint32_t member = 0; member + 1 < o.size(); ++member) {
                    const std::uint32_t offset = find(offsets_, {id, member}, "offset");
                    size = std::max(size, offset + size_of(o[member + 1]));
                }
                return size;
            }
            default:
                refuse("an argument of type opcode " + std::to_string(type.opcode));
        }
    }

private:
    template <class Map>
    static const typename Map::mapped_type& find(const Map& map, const typename Map::key_type& key,
                                                 const char* what) {
        const auto place = map.find(key);
        if (place == map.end()) refuse(std::string("a missing ") + what);
        return place->second;
    }

    using Pair = std::pair<std::uint32_t, std::uint32_t>;
    std::map<std::uint32_t, SpirvInstruction> types_;
    std::map<std::uint32_t, std::uint32_t> constants_;
    std::map<Pair, std::uint32_t> decorations_;
    std::map<Pair, std::uint32_t> offsets_;
};

/// `usamplerBuffer` and `uimageBuffer` of GLSL.
VkDescriptorType opaque_type(const Types& types, std::uint32_t id) {
    constexpr std::uint32_t kBuffer = 5;
    constexpr std::uint32_t kSampled = 1;
    const bool is_sampler = types[id].opcode == kTypeSampledImage;
    const SpirvInstruction& image = types[is_sampler ? types[id].operands[1] : id];
    if (image.opcode != kTypeImage || image.operands[2] != kBuffer)
        refuse("a resource that is not a buffer");
    return image.operands[6] == kSampled ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
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

ShaderInterface shader_interface(std::span<const std::uint32_t> words) {
    const std::vector<SpirvInstruction> instructions = read_spirv(words);
    const Types types(instructions);
    ShaderInterface result;
    for (const SpirvInstruction& i : instructions) {
        if (i.opcode != kVariable) continue;
        const std::uint32_t variable = i.operands[1];
        const std::uint32_t type = types[i.operands[0]].operands[2];
        const std::uint32_t storage = i.operands[2];
        if (storage == kPushConstant) result.argument_bytes = types.size_of(type);
        if (storage == kUniform) refuse("a uniform buffer");
        if (storage != kUniformConstant && storage != kStorageBuffer) continue;
        if (types.decoration(variable, kDescriptorSet) != 0) refuse("a second descriptor set");
        result.bindings.push_back({types.decoration(variable, kBinding),
                                   storage == kStorageBuffer ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
                                                             : opaque_type(types, type)});
    }
    std::ranges::sort(result.bindings, {}, &ShaderBinding::number);
    return result;
}

}  // namespace mray::gpu
