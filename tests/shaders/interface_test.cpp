// The resources of kernels as the host reads them from the SPIR-V.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "common/base/errors.h"
#include "gpu/vulkan/spirv.h"
#include "shaders/kernel_interface.h"
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

namespace mray::test {
namespace {

using Words = std::span<const std::uint32_t>;

constexpr auto kUniformTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
constexpr auto kStorageTexels = VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER;
constexpr auto kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;

TEST(ShaderInterface, HasTheBindingsOfTheSourceWithTheirTypes) {
    using Bindings = std::vector<gpu::ShaderBinding>;
    EXPECT_EQ(gpu::shader_interface(k_refit_leaves_spirv).bindings,
              (Bindings{{kBindLeafVertices, kUniformTexels},
                        {kBindLeafParents, kUniformTexels},
                        {kBindPose, kUniformTexels},
                        {kBindNodesOut, kStorageTexels},
                        {kBindLeavesOut, kStorageTexels}}));
    EXPECT_EQ(gpu::shader_interface(k_rays_spirv).bindings, (Bindings{{kBindNodes, kStorageTexels},
                                                                      {kBindLeaves, kStorageTexels},
                                                                      {kBindRays, kUniformTexels},
                                                                      {kBindHits, kStorage},
                                                                      {kBindWork, kStorage}}));
}

TEST(ShaderInterface, HasTheSizeOfTheArguments) {
    const auto bytes = [](Words words) { return gpu::shader_interface(words).argument_bytes; };
    for (const Words words : {Words(k_primary_spirv), Words(k_light_packet_spirv),
                              Words(k_compact_spirv), Words(k_shade_spirv)}) {
        EXPECT_EQ(bytes(words), sizeof(RegionArguments));
    }
    EXPECT_EQ(bytes(k_camera_packet_spirv), sizeof(PacketArguments));
    EXPECT_EQ(bytes(k_occlusion_spirv), sizeof(OcclusionArguments));
    EXPECT_EQ(bytes(k_occlusion_packet_spirv), sizeof(OcclusionArguments));
    EXPECT_EQ(bytes(k_rays_spirv), sizeof(RaysArguments));
    EXPECT_EQ(bytes(k_resume_spirv), sizeof(ResumeArguments));
    EXPECT_EQ(bytes(k_refit_leaves_spirv), sizeof(RefitArguments));
    EXPECT_EQ(bytes(k_refit_nodes_spirv), sizeof(RefitArguments));
}

TEST(ShaderInterface, StaysWithinTheBuffersThatEveryDeviceHas) {
    for (const Words words :
         {Words(k_primary_spirv), Words(k_camera_packet_spirv), Words(k_light_packet_spirv),
          Words(k_rays_spirv), Words(k_compact_spirv), Words(k_occlusion_spirv),
          Words(k_occlusion_packet_spirv), Words(k_resume_spirv), Words(k_shade_spirv),
          Words(k_refit_leaves_spirv), Words(k_refit_nodes_spirv)}) {
        const gpu::ShaderInterface interface = gpu::shader_interface(words);
        for (const VkDescriptorType type : {kStorageTexels, kStorage})
            EXPECT_LE(std::ranges::count(interface.bindings, type, &gpu::ShaderBinding::type), 4);
        for (const gpu::ShaderBinding& binding : interface.bindings)
            EXPECT_LT(binding.number, kBindingCount);
    }
}

TEST(ShaderInterface, RefusesOtherResources) {
    // A float, a pointer to it in a uniform buffer, and a variable of that type.
    const std::uint32_t words[] = {0x07230203,    0, 0,  9, 0,  //
                                   3u << 16 | 22, 1, 32,        //
                                   4u << 16 | 32, 2, 2,  1,     //
                                   4u << 16 | 59, 2, 3,  2};
    EXPECT_THROW(gpu::shader_interface(words), Error);
}

}  // namespace
}  // namespace mray::test
