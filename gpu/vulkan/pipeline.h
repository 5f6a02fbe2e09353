// A kernel: its SPIR-V, its compiled pipeline, and the resources that a user of it binds.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "gpu/vulkan/device.h"

namespace mray::gpu {

struct SpirvInstruction {
    std::uint32_t opcode = 0;
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

/// The words without the float modes of kernel.glsl, which need a device that promises them.
std::vector<std::uint32_t> without_float_modes(std::span<const std::uint32_t> words);

/// Bytes of push constants that every device supports.
inline constexpr std::uint32_t kMostArgumentBytes = 128;

/// Threads may share it.
class Pipeline {
public:
    /// Bindings come from the SPIR-V. `specialisation` has the values of 32-bit constants 0, 1, ...
    Pipeline(Device& device, std::span<const std::uint32_t> spirv,
             std::span<const std::uint32_t> specialisation = {});

    std::span<const ShaderBinding> bindings() const { return bindings_; }
    VkDescriptorSetLayout set_layout() const { return set_layout_.get(); }
    VkPipelineLayout layout() const { return layout_.get(); }
    VkPipeline get() const { return pipeline_.get(); }

    /// Whether it has been dispatched: some drivers finish compiling only then.
    bool is_warm() const { return is_warm_; }
    void set_warm() { is_warm_ = true; }

private:
    std::vector<ShaderBinding> bindings_;
    UniqueDescriptorSetLayout set_layout_;
    UniquePipelineLayout layout_;
    UniquePipeline pipeline_;
    std::atomic<bool> is_warm_ = false;
};

/// A pipeline with resources of its own.
class BoundPipeline {
public:
    BoundPipeline(Device& device, Pipeline& pipeline);

    Pipeline& pipeline() const { return *pipeline_; }
    /// Binds the resources that the kernel uses. Not while its work is recorded or under way.
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
    Pipeline* pipeline_;
    UniqueDescriptorPool pool_;
    VkDescriptorSet set_ = VK_NULL_HANDLE;
};

/// The pipelines of a device, each compiled once, at its first use. Threads may share it.
class Pipelines {
public:
    /// The words must outlive this. Throws Error, and can then be called again.
    Pipeline& get(Device& device, std::span<const std::uint32_t> spirv,
                  const std::vector<std::uint32_t>& specialisation);

private:
    struct Entry {
        std::mutex mutex;
        std::unique_ptr<Pipeline> pipeline;
    };
    using Key = std::pair<const std::uint32_t*, std::vector<std::uint32_t>>;

    std::mutex mutex_;
    std::map<Key, Entry> entries_;
};

}  // namespace mray::gpu
