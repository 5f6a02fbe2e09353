#include "gpu/vulkan/pipeline.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace mray::gpu {
namespace {

// Numbers of the SPIR-V specification.
constexpr std::size_t kHeaderWords = 5;
enum Op : std::uint32_t {
    kExtension = 10,
    kExecutionMode = 16,
    kCapability = 17,
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
VkDescriptorType opaque_type(Types& types, std::uint32_t id) {
    constexpr std::uint32_t kBuffer = 5;
    constexpr std::uint32_t kSampledImage = 1;
    const SpirvInstruction& type = types[id];
    const SpirvInstruction& image =
        type.opcode == kTypeSampledImage ? types[type.operands[1]] : type;
    if (image.opcode != kTypeImage || image.operands[2] != kBuffer)
        refuse("a resource that is not a buffer");
    return image.operands[6] == kSampledImage ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
                                              : VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER;
}

}  // namespace

std::vector<SpirvInstruction> read_spirv(std::span<const std::uint32_t> words) {
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

std::vector<std::uint32_t> without_float_modes(std::span<const std::uint32_t> words) {
    const auto is_float_mode = [](const SpirvInstruction& i) {
        const auto& o = i.operands;
        if (i.opcode == kExtension) {
            const char* const name = reinterpret_cast<const char*>(o.data());
            return std::strcmp(name, "SPV_KHR_float_controls") == 0;
        }
        // The modes of that extension, and their capabilities.
        if (i.opcode == kCapability) return o[0] >= 4464 && o[0] <= 4468;
        return i.opcode == kExecutionMode && o[1] >= 4459 && o[1] <= 4463;
    };
    const std::vector<SpirvInstruction> instructions = read_spirv(words);
    std::vector<std::uint32_t> kept(words.begin(), words.begin() + kHeaderWords);
    for (const SpirvInstruction& i : instructions) {
        if (is_float_mode(i)) continue;
        kept.insert(kept.end(), i.operands.data() - 1, i.operands.data() + i.operands.size());
    }
    return kept;
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

Pipeline::Pipeline(Device& device, std::span<const std::uint32_t> spirv,
                   std::span<const std::uint32_t> specialisation)
    : bindings_(shader_bindings(spirv)) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (const auto& [number, type] : bindings_) {
        bindings.push_back({.binding = number,
                            .descriptorType = type,
                            .descriptorCount = 1,
                            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT});
    }
    const VkDescriptorSetLayoutCreateInfo set_info = {
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
        .bindingCount = static_cast<std::uint32_t>(bindings.size()),
        .pBindings = bindings.data()};
    set_layout_ = {device.get(), vkCreateDescriptorSetLayout, set_info, "create a set layout"};

    const VkDescriptorSetLayout set_layout = set_layout_.get();
    const VkPushConstantRange arguments = {.stageFlags = VK_SHADER_STAGE_COMPUTE_BIT,
                                           .size = kMostArgumentBytes};
    const VkPipelineLayoutCreateInfo layout_info = {
        .sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
        .setLayoutCount = 1,
        .pSetLayouts = &set_layout,
        .pushConstantRangeCount = 1,
        .pPushConstantRanges = &arguments};
    layout_ = {device.get(), vkCreatePipelineLayout, layout_info, "create a pipeline layout"};

    std::vector<std::uint32_t> plain;
    if (!device.physical().info.promises_floats) spirv = plain = without_float_modes(spirv);
    const VkShaderModuleCreateInfo module_info = {
        .sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
        .codeSize = spirv.size_bytes(),
        .pCode = spirv.data()};
    const UniqueShaderModule module(device.get(), vkCreateShaderModule, module_info,
                                    "create a shader module");
    std::vector<VkSpecializationMapEntry> entries;
    for (std::uint32_t i = 0; i < specialisation.size(); ++i)
        entries.push_back({.constantID = i, .offset = 4 * i, .size = 4});
    const VkSpecializationInfo constants = {
        .mapEntryCount = static_cast<std::uint32_t>(entries.size()),
        .pMapEntries = entries.data(),
        .dataSize = specialisation.size_bytes(),
        .pData = specialisation.data()};
    const VkComputePipelineCreateInfo info = {
        .sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO,
        .stage = {.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO,
                  .stage = VK_SHADER_STAGE_COMPUTE_BIT,
                  .module = module.get(),
                  .pName = "main",
                  .pSpecializationInfo = &constants},
        .layout = layout_.get()};
    VkPipeline pipeline = VK_NULL_HANDLE;
    check(vkCreateComputePipelines(device.get(), VK_NULL_HANDLE, 1, &info, nullptr, &pipeline),
          "create a compute pipeline");
    pipeline_ = {device.get(), pipeline};
}

BoundPipeline::BoundPipeline(Device& device, Pipeline& pipeline)
    : device_(device.get()), pipeline_(&pipeline) {
    std::vector<VkDescriptorPoolSize> sizes;
    for (const auto& [number, type] : pipeline.bindings())
        sizes.push_back({.type = type, .descriptorCount = 1});
    const VkDescriptorPoolCreateInfo pool = {
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
        .maxSets = 1,
        .poolSizeCount = static_cast<std::uint32_t>(sizes.size()),
        .pPoolSizes = sizes.data()};
    pool_ = {device_, vkCreateDescriptorPool, pool, "create a descriptor pool"};
    const VkDescriptorSetLayout layout = pipeline.set_layout();
    const VkDescriptorSetAllocateInfo set = {
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
        .descriptorPool = pool_.get(),
        .descriptorSetCount = 1,
        .pSetLayouts = &layout};
    check(vkAllocateDescriptorSets(device_, &set, &set_), "allocate a descriptor set");
}

void BoundPipeline::bind(const Bindings& bindings) {
    std::array<VkDescriptorBufferInfo, kBindingCount> buffers = {};
    std::vector<VkWriteDescriptorSet> writes;
    for (const auto& [b, type] : pipeline_->bindings()) {
        assert(b < kBindingCount);
        assert(bindings.views[b] != VK_NULL_HANDLE || bindings.buffers[b] != VK_NULL_HANDLE);
        buffers[b] = {.buffer = bindings.buffers[b], .offset = 0, .range = VK_WHOLE_SIZE};
        writes.push_back({
            .sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET,
            .dstSet = set_,
            .dstBinding = b,
            .descriptorCount = 1,
            .descriptorType = type,
            .pBufferInfo = &buffers[b],
            .pTexelBufferView = &bindings.views[b],
        });
    }
    vkUpdateDescriptorSets(device_, static_cast<std::uint32_t>(writes.size()), writes.data(), 0,
                           nullptr);
}

void BoundPipeline::dispatch_bytes(VkCommandBuffer commands, std::span<const std::byte> arguments,
                                   std::uint32_t group_count) const {
    assert(arguments.size() <= kMostArgumentBytes);
    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_->get());
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_->layout(), 0, 1,
                            &set_, 0, nullptr);
    vkCmdPushConstants(commands, pipeline_->layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0,
                       static_cast<std::uint32_t>(arguments.size()), arguments.data());
    vkCmdDispatch(commands, group_count, 1, 1);
}

Pipeline& Pipelines::get(Device& device, std::span<const std::uint32_t> spirv,
                         const std::vector<std::uint32_t>& specialisation) {
    std::unique_lock lock(mutex_);
    Entry& entry = entries_[{spirv.data(), specialisation}];
    lock.unlock();
    // Different kernels are compiled at the same time.
    const std::scoped_lock entry_lock(entry.mutex);
    if (entry.pipeline == nullptr)
        entry.pipeline = std::make_unique<Pipeline>(device, spirv, specialisation);
    return *entry.pipeline;
}

}  // namespace mray::gpu
