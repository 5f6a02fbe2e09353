// The SPIR-V of every kernel: float modes, exact operations, and resources as the host reads them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "gpu/limits.h"
#include "shaders/morphray_kernels.h"
#include "tests/shaders/evaluate_contracted_spirv.h"
#include "tests/shaders/evaluate_spirv.h"
#include "tests/support/spirv.h"

namespace mray::test {
namespace {

struct Kernel {
    const char* name;
    std::span<const std::uint32_t> words;
};

#define KERNEL(name) {#name, k_##name##_spirv},
const Kernel kKernels[] = {MORPHRAY_KERNELS(KERNEL)};
#undef KERNEL

/// The kernels whose bits are those of the CPU.
std::vector<Kernel> exact_kernels() {
    std::vector<Kernel> kernels = {{"evaluate", k_evaluate_spirv}};
    kernels.insert(kernels.end(), std::begin(kKernels), std::end(kKernels));
    return kernels;
}

class ExactKernel : public testing::TestWithParam<Kernel> {};

TEST_P(ExactKernel, RoundsToNearestAndKeepsZerosInfinitiesAndNans) {
    constexpr std::uint32_t kRoundingModeRte = 4462;
    constexpr std::uint32_t kSignedZeroInfNanPreserve = 4461;
    const SpirvModule module(GetParam().words);
    EXPECT_TRUE(module.has_execution_mode(kRoundingModeRte, 32));
    EXPECT_TRUE(module.has_execution_mode(kSignedZeroInfNanPreserve, 32));
}

TEST_P(ExactKernel, ComputesWithExactOperationsOnly) {
    const std::vector<std::string> found = inexact_operations(SpirvModule(GetParam().words));
    EXPECT_TRUE(found.empty()) << found.size() << ", the first: " << found.front();
}

/// Whether a capability lets lanes of a subgroup see each other: those of Vulkan 1.1
/// (GroupNonUniform to GroupNonUniformQuad), of the extensions before it, and partitions and
/// rotations.
bool is_of_subgroups(std::uint32_t capability) {
    const bool is_core = capability >= 61 && capability <= 68;
    const bool is_extension = capability == 4423 || capability == 4431 || capability == 5297;
    return is_core || is_extension || capability == 6026;
}

// Lanes of a subgroup may part where control flow is not uniform, so no kernel relies on them.
TEST(Kernels, HaveNoSubgroupCapability) {
    for (const Kernel& kernel : kKernels) {
        const SpirvModule module(kernel.words);
        for (const gpu::SpirvInstruction& i : module.instructions()) {
            EXPECT_FALSE(i.opcode == kOpCapability && is_of_subgroups(i.operands[0]))
                << kernel.name << ", capability " << i.operands[0];
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Shaders, ExactKernel, testing::ValuesIn(exact_kernels()),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(InexactOperations, AreFoundWhereContractionIsAllowed) {
    EXPECT_GT(inexact_operations(SpirvModule(k_evaluate_contracted_spirv)).size(), 100u);
}

TEST(InexactOperations, AreFoundWhereAnInstructionIsNotAllowed) {
    // A module of one OpFDiv, one OpDot, and one OpExtInst Sqrt.
    const std::uint32_t words[] = {0x07230203,     0, 0, 9, 0,  //
                                   5u << 16 | 136, 1, 2, 3, 4,  //
                                   5u << 16 | 148, 1, 5, 3, 4,  //
                                   6u << 16 | 12,  1, 6, 7, 31, 3};
    EXPECT_EQ(inexact_operations(SpirvModule(words)).size(), 3u);
}

TEST(SpirvModule, RejectsWordsThatAreNoModule) {
    const std::uint32_t wrong_magic[] = {1, 2, 3, 4, 5};
    const std::uint32_t truncated[] = {0x07230203, 0, 0, 9, 0, 5u << 16 | 136};
    EXPECT_THROW(SpirvModule{wrong_magic}, Error);
    EXPECT_THROW(SpirvModule{truncated}, Error);
}

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
