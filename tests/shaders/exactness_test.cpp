// Every kernel has the float modes and the exact operations that give the image of the CPU.
#include <gtest/gtest.h>

#include <cstdint>

#include "common/base/errors.h"
#include "shaders/occlusion/occlusion_packet_spirv.h"
#include "shaders/occlusion/occlusion_spirv.h"
#include "shaders/packet/camera_packet_spirv.h"
#include "shaders/packet/light_packet_spirv.h"
#include "shaders/refit/refit_leaves_spirv.h"
#include "shaders/refit/refit_nodes_spirv.h"
#include "shaders/shade/compact_spirv.h"
#include "shaders/shade/shade_spirv.h"
#include "shaders/single_ray/primary_spirv.h"
#include "shaders/single_ray/rays_spirv.h"
#include "shaders/single_ray/resume_spirv.h"
#include "tests/shaders/evaluate_contracted_spirv.h"
#include "tests/shaders/evaluate_spirv.h"
#include "tests/support/spirv.h"

namespace mray::test {
namespace {

struct Kernel {
    const char* name;
    std::span<const std::uint32_t> words;
};

const Kernel kKernels[] = {
    {"occlusion", k_occlusion_spirv},
    {"primary", k_primary_spirv},
    {"rays", k_rays_spirv},
    {"refit_leaves", k_refit_leaves_spirv},
    {"refit_nodes", k_refit_nodes_spirv},
    {"resume", k_resume_spirv},
    {"compact", k_compact_spirv},
    {"shade", k_shade_spirv},
    {"evaluate", k_evaluate_spirv},
};

/// Kernels with arithmetic outside the hit rule, whose bounds hold in any order and with any
/// fusion.
const Kernel kPacketKernels[] = {
    {"occlusion_packet", k_occlusion_packet_spirv},
    {"camera_packet", k_camera_packet_spirv},
    {"light_packet", k_light_packet_spirv},
};

class EveryKernel : public testing::TestWithParam<Kernel> {};

void expect_modes(const Kernel& kernel) {
    constexpr std::uint32_t kRoundingModeRte = 4462;
    constexpr std::uint32_t kSignedZeroInfNanPreserve = 4461;
    const SpirvModule module(kernel.words);
    EXPECT_TRUE(module.has_execution_mode(kRoundingModeRte, 32)) << kernel.name;
    EXPECT_TRUE(module.has_execution_mode(kSignedZeroInfNanPreserve, 32)) << kernel.name;
}

TEST_P(EveryKernel, RoundsToNearestAndKeepsZerosInfinitiesAndNans) { expect_modes(GetParam()); }

TEST(PacketKernels, RoundToNearestAndKeepZerosInfinitiesAndNans) {
    for (const Kernel& kernel : kPacketKernels) expect_modes(kernel);
}

TEST_P(EveryKernel, ComputesWithExactOperationsOnly) {
    const std::vector<std::string> found = inexact_operations(SpirvModule(GetParam().words));
    EXPECT_TRUE(found.empty()) << found.size() << ", the first: " << found.front();
}

INSTANTIATE_TEST_SUITE_P(Shaders, EveryKernel, testing::ValuesIn(kKernels),
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
