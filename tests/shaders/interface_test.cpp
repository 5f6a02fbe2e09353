// The resources of kernels as the host reads them from the SPIR-V.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "common/base/errors.h"
#include "gpu/limits.h"
#include "gpu/vulkan/spirv.h"
#include "shaders/kernel_interface.h"
#include "tests/shaders/kernel_table.h"

namespace mray::test {
namespace {

constexpr auto kUniformTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
constexpr auto kStorageTexels = VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER;
constexpr auto kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;

TEST(ShaderInterface, HasTheBindingsOfTheSourceWithTheirTypes) {
    using Bindings = std::vector<gpu::ShaderBinding>;
    EXPECT_EQ(gpu::shader_bindings(k_refit_leaves_spirv),
              (Bindings{{kBindPositions, kUniformTexels},
                        {kBindLeafVertices, kUniformTexels},
                        {kBindLeafParents, kUniformTexels},
                        {kBindNodeWords, kStorageTexels},
                        {kBindLeafWords, kStorageTexels},
                        {kBindGroupWords, kStorageTexels}}));
    EXPECT_EQ(gpu::shader_bindings(k_rays_spirv), (Bindings{{kBindNodes, kStorageTexels},
                                                            {kBindLeaves, kStorageTexels},
                                                            {kBindRays, kUniformTexels},
                                                            {kBindHits, kStorage},
                                                            {kBindWork, kStorage},
                                                            {kBindQuarters, kStorageTexels},
                                                            {kBindGroups, kStorageTexels}}));
    for (const gpu::ShaderBinding& binding : gpu::shader_bindings(k_rays_storage_spirv))
        EXPECT_EQ(binding.type, kStorage);
}

TEST(ShaderInterface, StaysWithinTheBuffersThatItsDevicesHave) {
    for (const Kernel& kernel : kKernels) {
        const std::vector<gpu::ShaderBinding> bindings = gpu::shader_bindings(kernel.words);
        EXPECT_FALSE(bindings.empty()) << kernel.name;
        const bool has_texels = std::ranges::any_of(
            bindings, [](const auto& binding) { return binding.type != kStorage; });
        for (const VkDescriptorType type : {kStorageTexels, kStorage})
            EXPECT_LE(std::ranges::count(bindings, type, &gpu::ShaderBinding::type),
                      has_texels ? 4 : gpu::kMostStorageBuffers)
                << kernel.name;
        for (const gpu::ShaderBinding& binding : bindings)
            EXPECT_LT(binding.number, kBindingCount) << kernel.name;
    }
}

TEST(ShaderInterface, RefusesOtherResources) {
    // A float, a pointer to it in a uniform buffer, and a variable of that type.
    const std::uint32_t words[] = {0x07230203,    0, 0,  9, 0,  //
                                   3u << 16 | 22, 1, 32,        //
                                   4u << 16 | 32, 2, 2,  1,     //
                                   4u << 16 | 59, 2, 3,  2};
    EXPECT_THROW(gpu::shader_bindings(words), Error);
}

}  // namespace
}  // namespace mray::test
