// Every kernel has the float modes and the exact operations that give the image of the CPU.
#include <gtest/gtest.h>

#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "tests/shaders/evaluate_contracted_spirv.h"
#include "tests/shaders/evaluate_spirv.h"
#include "tests/shaders/kernel_table.h"
#include "tests/support/spirv.h"

namespace mray::test {
namespace {

/// The kernels whose bits are those of the CPU.
std::vector<Kernel> exact_kernels() {
    std::vector<Kernel> kernels = {{"evaluate", k_evaluate_spirv}};
    kernels.insert(kernels.end(), std::begin(kKernels), std::end(kKernels));
    return kernels;
}

class ExactKernel : public testing::TestWithParam<Kernel> {};

void expect_modes(std::span<const std::uint32_t> words) {
    constexpr std::uint32_t kRoundingModeRte = 4462;
    constexpr std::uint32_t kSignedZeroInfNanPreserve = 4461;
    const SpirvModule module(words);
    EXPECT_TRUE(module.has_execution_mode(kRoundingModeRte, 32));
    EXPECT_TRUE(module.has_execution_mode(kSignedZeroInfNanPreserve, 32));
}

TEST(Kernels, RoundToNearestAndKeepZerosInfinitiesAndNans) {
    expect_modes(k_evaluate_spirv);
    for (const Kernel& kernel : kKernels) {
        SCOPED_TRACE(kernel.name);
        expect_modes(kernel.words);
    }
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

}  // namespace
}  // namespace mray::test
